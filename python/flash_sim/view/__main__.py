"""python -m flash_sim.view run|scene|recording ...: a page in the browser that shows it."""
import argparse
import pathlib
import signal
import sys

from flash_sim.bag.errors import RecordingError, one_line
from flash_sim.view import page

NAME = "flash_sim.view"
DONE, FAILED, BAD_INPUT = 0, 1, 2
EXAMPLES = """examples:
  python -m flash_sim.view run demo/run
  python -m flash_sim.view recording demo/lift --camera examples/towel_lift/camera1
  python -m flash_sim.view scene examples/scenes/fold.json --envs 4 --randomize published"""


class Parser(argparse.ArgumentParser):
    """Refuses in one line."""

    def error(self, message):
        self.exit(BAD_INPUT, f"{NAME}: {message}\n")


def parser():
    """The command line."""
    p = Parser(prog=f"python -m {NAME}", epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False,
               description="Shows what was simulated and seen on a page that this machine alone can open (127.0.0.1).")
    verbs = p.add_subparsers(dest="verb", metavar="run|scene|recording", required=True)

    def verb(name, words):
        v = verbs.add_parser(name, help=words, description=words[0].upper() + words[1:] + ".", allow_abbrev=False)
        v.add_argument("--port", type=whole(0, 64535), default=8080, metavar="N",
                       help="port of the page (8080), the next free one where it is in use; 0: any")
        return v
    v = verb("run", "the answer of a search: its motion over what was seen, with its numbers")
    v.add_argument("folders", nargs="+", metavar="FOLDER", help="folders of flash-sysid grid, fit and replay, to choose from")
    v = verb("scene", "a scene that is simulated while you look")
    v.add_argument("file", metavar="FILE", help="a scene file")
    v.add_argument("--envs", type=whole(1, 10000), default=1, metavar="N", help="environments, one of which is shown (1)")
    v.add_argument("--randomize", choices=("identified", "published", "none"), default="none",
                   help="materials drawn for each environment (none)")
    v.add_argument("--seed", type=whole(0, 2**31 - 1), default=0, metavar="N", help="of these draws (0)")
    v.add_argument("--device", default="auto", metavar="DEVICE", help="where it is stepped: cpu, cuda, cuda:1 or auto")
    v = verb("recording", "what was seen of an object over time, and what held it")
    v.add_argument("folder", metavar="FOLDER", help="folder with recording.json")
    v.add_argument("--camera", nargs="+", default=[], metavar="FOLDER",
                   help="folders with camera_info.yaml and extrinsics.json of cameras that are drawn too")
    return p


def whole(low, high):
    """A type of options: a whole number between two."""
    def parse(text):
        if not (text.isascii() and text.isdigit() and low <= int(text) <= high):
            raise argparse.ArgumentTypeError(f"found \"{text}\", expected a whole number from {low} to {high}")
        return int(text)
    return parse


def load(settings):
    """What is to be shown, as a function of the server, and its paths."""
    if settings.verb == "run":
        from flash_sim.view import run
        runs = run.load_runs(settings.folders)
        return lambda server: run.show(server, runs), settings.folders
    if settings.verb == "recording":
        from flash_sim.view import recording
        loaded = recording.load_recording(settings.folder, settings.camera)
        return lambda server: recording.show(server, loaded), [settings.folder]
    from flash_sim.view import scene
    sim = scene.start(settings.file, settings.envs, settings.randomize, settings.seed, settings.device)
    return lambda server: scene.show(server, sim), [settings.file]


def main(arguments=None):
    """Runs the command line `arguments`; the exit code. Whatever is refused is one line on stderr and 2."""
    settings = parser().parse_args(arguments)
    try:
        page.expect_viser()
        show, paths = load(settings)
    except (RecordingError, ValueError) as error:
        print(f"{NAME}: {one_line(str(error))}", file=sys.stderr)
        return BAD_INPUT
    except OSError as error:
        print(one_line(f"{NAME}: {error.filename}: {error.strerror}"), file=sys.stderr)
        return FAILED
    server = page.open_page(", ".join(pathlib.Path(path).name for path in paths), settings.port)
    try:
        page.serve(server, ", ".join(paths), show(server))
    except KeyboardInterrupt:
        return DONE


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    sys.exit(main())
