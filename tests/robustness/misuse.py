#!/usr/bin/env python3
"""What people do to the programs: files of options that are none, values out of all range, places that cannot be written,
calibrations that cannot be used, and guesses that are wrong. Each is answered at once and in one line, and what was taken
all the same is named wherever it goes."""
import argparse
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import program
from malformed_inputs import CAMERA, png

FAILED, REFUSED = 1, 2
HANG = 60  # seconds after which a program that should answer at once counts as hanging
GRIPPER = "0 0.2 0.2 {z} 0 0 0 1\n1 0.2 0.2 {z} 0 0 0 1\n2 0.2 0.2 0.3 0 0 0 1\n"


def scene(mesh, **fields):
    return {"schema": "flash-scene/1", "timestep": 0.01, "steps": 1, "gravity": [0, 0, -9.81],
            "objects": {"cloth": mesh}} | fields


def clouds(folder, frames):
    """A level sheet as a grid of points, 5 mm apart."""
    points = [f"{0.005 * (k % 20)} {0.005 * (k // 20)} 0.1" for k in range(400)]
    folder.mkdir()
    for k in range(frames):
        (folder / f"{k:04d}.ply").write_text("\n".join([
            "ply", "format ascii 1.0", "element vertex 400", "property float x", "property float y", "property float z",
            "end_header", *points, ""]))


def depth_view(folder, calibration):
    """A camera one metre above the gripper, looking down on a level sheet 0.1 m above the base."""
    (folder / "depth").mkdir(parents=True)
    (folder / "camera_info.yaml").write_text(CAMERA)
    picture = png(8, 6, 16, [(900).to_bytes(2, "big") * 8] * 6)
    for k in range(3):
        (folder / "depth" / f"{k}.png").write_bytes(picture)
    (folder / "extrinsics.json").write_text(json.dumps(calibration))


def write_inputs(folder):
    (folder / "cloth.json").write_text(json.dumps(program.ASSET))
    (folder / "large.json").write_text(json.dumps(program.ASSET | {"mesh": "sheet:2x2:0.005"}))
    (folder / "short.json").write_text(json.dumps(scene("cloth.json")))
    (folder / "slow.json").write_text(json.dumps(scene("large.json")))
    (folder / "heavy.json").write_text(json.dumps(scene("cloth.json", gravity=[0, 0, -1e6])))
    (folder / "loose.json").write_text(json.dumps(scene("cloth.json", solver={"tolerance": 1e300})))
    (folder / "long_name.json").write_text(json.dumps(scene("cloth.json") | {"x" * 5000: 1}))
    (folder / "gripper.tum").write_text(GRIPPER.format(z=0))
    (folder / "high.tum").write_text(GRIPPER.format(z=0.2))
    sound = {"schema": "flash-extrinsics/1", "exit_code": 0, "warnings": ["two views were left out"],
             "transform": {"translation": [0.2, 0.2, 1], "rotation_xyzw": [1, 0, 0, 0]}}
    depth_view(folder / "view", sound)
    clouds(folder / "many", 200)
    (folder / "partial.json").write_text(json.dumps(sound | {"one_axis": {"told": False, "camera_axis": [0, 0, 1], "camera_m": 1}}))
    (folder / "unusable.json").write_text(json.dumps(sound | {"exit_code": 3, "warnings": ["one axis only", "second"]}))
    for name, old, new in (("tele", "[50", "[1e300"), ("centre", "0, 4,", "0, 1e300,")):
        (folder / f"{name}.yaml").write_text(CAMERA.replace(old, new, 1))


def left_in(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def refused(options, folder, words, *expected, **more):
    """Statements: exit code 2, one line that has all of `expected`, nothing left."""
    before = left_in(folder)
    try:
        done = program.call(*words, cwd=folder, timeout=HANG, **more)
    except subprocess.TimeoutExpired:
        yield False, f"{words[1:]}: does not end"
        return
    text, where = done.stderr.rstrip("\n"), " ".join(map(str, words[1:]))[:150]
    yield done.returncode == REFUSED, f"{where}: exit code {done.returncode}: {text[:500]}"
    yield text and "\n" not in text and len(text) < 2200, f"{where}: not one line to read: {text[:300]}"
    yield all(word in text for word in expected), f"{where}: does not say {expected}: {text[:500]}"
    left = set(left_in(folder)) - set(before)
    yield not left, f"{where}: left {sorted(left)[:5]}"
    for name in {path.split("/")[0] for path in left} - set(before):
        shutil.rmtree(folder / name) if (folder / name).is_dir() else (folder / name).unlink()


def check_config(options, folder):
    """--config of the three programs."""
    os.mkfifo(folder / "pipe.toml")
    (folder / "folder.toml").mkdir()
    for name, content in (("garbage", bytes(range(256))), ("zeros", bytes(5000)), ("braces", b"}{][\n"), ("two", b"}{"), ("bracket", b"# fine\n[synth]\n  ]\n"), ("empty", b""),
                          ("long", b"a" * 2_000_000), ("key", b"quitness=1\n"), ("section", b"[grdi]\nenvs=8\n"),
                          ("range", b"[synth]\nrate=-1\n"), ("number", b"[synth]\nrate=\"often\"\n"),
                          ("verb_key", b"[synth]\nrat=5\n"), ("good", b"[synth]\nduration=0.2\nrate=20\nquiet=true\n")):
        (folder / f"{name}.toml").write_bytes(content)
    synth = ["synth", "--asset", "cloth.json", "--kind", "hang", "--json", "-o", "out"]
    programs = {options.sysid: synth, options.sim: ["run", "short.json", "-o", "out"]}
    if options.calib:
        programs[options.calib] = ["detect", ".", "--target", "chessboard:9x6:0.025"]
    for tool, verb in programs.items():
        for file, *expected in (("garbage.toml", "garbage.toml:1"), ("zeros.toml", "zeros.toml:1"),
                                ("pipe.toml", "pipe.toml", "a pipe"), ("/dev/zero", "/dev/zero", "a device"),
                                ("/dev/full", "/dev/full", "a device"), ("folder.toml", "folder.toml", "a folder"),
                                ("nowhere.toml", "nowhere.toml", "No such file"), ("braces.toml", "braces.toml"), ("two.toml", 'two.toml:1: found "}{"'),
                                ("bracket.toml", 'bracket.toml:3: found "]"'),
                                ("long.toml", "long.toml"), ("key.toml", "key.toml: quitness", "unknown option"),
                                ("section.toml", "section.toml: grdi", "unknown option or section")):
            yield from refused(options, folder, [tool, "--config", file, *verb], *expected)
    for file, *expected in (("range.toml", "--rate", "-1"), ("number.toml", "--rate", "often"),
                            ("verb_key.toml", "verb_key.toml: synth.rat", "unknown option")):
        yield from refused(options, folder, [options.sysid, "--config", file, *synth], *expected)
    # 0.2 s at 20 a second from the file, of which the command line takes one back.
    for more, keyframes in (([], 5), (["--rate", "10"], 3)):
        done = program.call(options.sysid, "--config", "good.toml", *synth, *more, "--force", cwd=folder)
        found = json.loads(done.stdout)["keyframes"] if done.returncode == 0 else done.stderr
        yield found == keyframes, f"--config good.toml {more}: {found} keyframes, expected {keyframes}"
        yield done.stderr == "", f"--config good.toml: quiet=true is not taken: {done.stderr}"
    done = program.call(options.sysid, "--config", "empty.toml", *synth, "--duration", "0.1", "--force", cwd=folder)
    yield done.returncode == 0, f"--config empty.toml: {done.stderr}"
    shutil.rmtree(folder / "out")


def check_words(options, folder):
    """Words that name nothing, something twice, or a file of another kind than is written."""
    for tool in filter(None, (options.sysid, options.sim, options.calib)):
        yield from refused(options, folder, [tool, "--verion"], "--verion: unknown option", 'did you mean "--version"?')
        yield from refused(options, folder, [tool, "--confg", "x.toml"], "--confg: unknown option", 'did you mean "--config"?')
        yield from refused(options, folder, [tool, "--json"], "--json: found before the verb, expected after it")
        yield from refused(options, folder, [tool, "--config", "good.toml", "--xyzzyx"], "--xyzzyx: unknown option (see --help)")
        done = program.call(tool, "--version")
        yield done.returncode == 0 and done.stdout, f"--version: {done.returncode} {done.stderr}"
    (folder / "triangle.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (folder / "same_view").symlink_to("view")
    search = ["recording", "--asset", "asset.json"]
    plan = [options.sysid, "plan", *search, "-o", "plan.json"]
    segment = [options.sysid, "segment", "--no-table", "-o", "out"]
    imported = [options.sysid, "import", "recording/frames", "--trajectory", "recording/gripper.tum", "--times", "rate:10",
                "--mesh", "sheet:0.2x0.2:0.05:alternating", "-o", "out"]
    for words, *expected in (
            ([options.sim, "picture", "triangle.obj", "-o", "p.jpg"], '--out: found "p.jpg"', "ends in .png"),
            ([options.sim, "picture", "triangle.obj", "-o", "p"], '--out: found "p"', "ends in .png"),
            ([options.sim, "picture", "triangle.obj", "triangle.obj", "-o", "p.png"], "triangle.obj twice"),
            ([options.sim, "bench", "--envs", "1,1"], "--envs: found 1 twice"),
            ([options.sim, "bench", "--envs", "1000000", "--threads", "2"], "--envs: 1,000,000", "days"),
            ([options.sysid, "export", "run", "-o", "tuned.yaml"], '--out: found "tuned.yaml"', "ends in .json"),
            ([options.sysid, "predict", "run", "recording", "-o", "p.csv"], '--out: found "p.csv"', "ends in .json"),
            ([*plan[:-1], "plan.txt"], '--out: found "plan.txt"', "ends in .json"),
            ([options.sysid, "compare", "run", "run2", "-o", "c.html"], '--out: found "c.html"', "ends in .json"),
            ([options.sysid, "report", "run", "-o", "r.pdf"], '--out: found "r.pdf"', "ends in .html"),
            ([options.sysid, "synth", "--asset", "cloth.json", "--truth-out", "t.txt", "-o", "out"], '"t.txt"', "in .json"),
            ([*segment, "view", "view"], "views: found view twice"),
            ([*segment, "view", "same_view"], "views: found view and same_view, which are the same"),
            ([*segment, "view", "many", "--extrinsics", "view/extrinsics.json", "view/extrinsics.json"], "--extrinsics: found", "twice"),
            ([options.sysid, "compare", "run", "./run"], "runs: found run and ./run, which are the same"),
            ([options.sysid, "repeatability", "recording", "recording"], "is the same recording"),
            ([options.sysid, "grid", *search[:1], *search, "--bending", "1e-4,2e-4", "-o", "out"], "is the same recording"),
            ([options.sysid, "report", "run", "--map", "bending,bending", "-o", "r.html"], "--map: found bending twice"),
            ([options.sysid, "replay", *search, "--frames", "1,2,1", "-o", "out"], "--frames: found 1 twice"),
            ([*imported, "--grasp", "vertices:99999999999"], '--grasp: found "vertices:99999999999"'),
            ([*imported, "--grasp", "vertices:3,3"], '--grasp: found "vertices:3,3"', "each vertex once"),
            ([*plan, "--bending", "1e-4"], "--bending: found one value", "--hold bending=0.0001"),
            ([*plan, "--hold", "bending"], "--hold"),
            ([*plan, "--run", "run", "--hold", "bending=1e-4"], "--hold: found it beside --run"),
            ([*plan, "--run", "run", "--bending", "1e-5:1e-3:3:log"], "--bending: found it beside --run")):
        yield from refused(options, folder, words, *expected)
    done = program.call(*plan, "--bending", "5e-5:2e-4:2:log", "--friction", "0.2:0.4:2", "--hold", "poisson=0.2", "--time-step",
                        "0.02", cwd=folder)
    yield done.returncode == 0, f"plan --hold: {done.returncode} {done.stderr}"
    planned = list(json.loads((folder / "plan.json").read_text())["parameters"]) if done.returncode == 0 else None
    yield planned == ["bending", "friction"], f"plan --hold: {planned}"
    for name in ("plan.json", "triangle.obj", "same_view"):
        (folder / name).unlink(missing_ok=True)
    # A name that is no UTF-8 is a name.
    odd = os.fsdecode(b"odd\xff")
    for words in ([options.sysid, "synth", "--asset", "cloth.json", "--kind", "hang", "--duration", "0.1", "-o", odd],
                  [options.sysid, "export", "run", "-o", odd + ".json"]):
        done = program.call(*words, "--json", cwd=folder)
        yield done.returncode in (0, 3) and "exception" not in done.stderr, f"a name of odd bytes: {done.returncode} {done.stderr}"
        yield json.loads(done.stdout or "0"), f"a name of odd bytes: {done.stdout[:200]}"
    shutil.rmtree(folder / odd, ignore_errors=True)
    (folder / (odd + ".json")).unlink(missing_ok=True)


def check_units(options, folder):
    """Numbers in other units than their fields: one notice with the usual range."""
    for field, value, *expected in (("areal_density", 150, "areal density found 150 kg/m^2", "0.01 to 20"),
                                    ("young", 50, "young with a thickness found 50 Pa", "1000 to 1e+12", "E t in N/m")):
        props = program.ASSET["mechanical_props"] | {field: value}
        (folder / "odd.json").write_text(json.dumps(program.ASSET | {"mechanical_props": props}))
        done = program.call(options.sysid, "grid", "recording", "--asset", "odd.json", "--friction", "0.2,0.3", "--no-plan",
                            "--no-solver-check", "--no-horizon", "-o", "odd_run", "--force", cwd=folder)
        lines = [line for line in done.stderr.splitlines() if "is the unit right?" in line]
        yield len(lines) == 1 and all(word in lines[0] for word in expected), f"{field} {value}: {lines} {done.stderr[:500]}"
        hold = {"areal_density": "areal_density=0.2", "young": "young=5e4"}[field]
        done = program.call(options.sysid, "grid", "recording", "--asset", "odd.json", "--friction", "0.2,0.3", "--hold", hold,
                            "--no-plan", "--no-solver-check", "--no-horizon", "-o", "odd_run", "--force", cwd=folder)
        yield "is the unit right?" not in done.stderr, f"--hold {hold}: {done.stderr}"
    (folder / "odd.json").unlink()
    shutil.rmtree(folder / "odd_run", ignore_errors=True)


def check_unusable(options, folder):
    """The last line on the terminal says that and why an answer cannot be used; the report says what to do next."""
    done = program.call(options.sysid, "grid", "recording", "--asset", "asset.json", "--young", "4.9e4,5e4,5.1e4", "--no-plan",
                        "--no-solver-check", "--no-horizon", "--tolerance", "1e-12", "--iterations", "1", "-o", "bad_run", cwd=folder)
    yield done.returncode == 3, f"a search that does not converge: {done.returncode} {done.stderr}"
    summary = json.loads((folder / "bad_run/summary.json").read_text())
    last = done.stderr.splitlines()[-1]
    yield last == f"flash-sysid: the answer cannot be used (exit code 3): {summary['warnings'][0]}", f"last line: {last}"
    yield "Next: " in done.stdout, f"nothing to do next: {done.stdout}"
    report = (folder / "bad_run/report.html").read_text()
    yield '"next_steps":[]' not in report and '"next_steps":["' in report, "report.html: nothing to do next"
    shutil.rmtree(folder / "bad_run")


def check_values(options, folder):
    """Numbers that no sheet, camera or solver has."""
    asset, run = ["--asset", "asset.json"], [options.sim, "run"]
    heavy = folder / "heavy"
    shutil.copytree(folder / "recording", heavy)
    content = json.loads((heavy / "recording.json").read_text())
    (heavy / "recording.json").write_text(json.dumps(content | {"gravity": [0, 0, -1e6]}))
    imported = [options.sysid, "import", "--depth", "view/depth", "--extrinsics", "view/extrinsics.json", "--trajectory",
                "gripper.tum", "--mesh", "sheet:0.2x0.2:0.01", "-o", "out"]
    for words, *expected in (
            ([*run, "heavy.json", "-o", "out"], "heavy.json: gravity", "-1000000.0", "at most 1000"),
            ([*run, "loose.json", "-o", "out"], "loose.json: solver.tolerance", "1e+300", "at most 1"),
            ([options.sysid, "replay", "heavy", *asset, "-o", "out"], "recording.json: gravity", "at most 1000"),
            ([*imported, "--intrinsics", "tele.yaml"], "tele.yaml: camera_matrix", "found 1e+300", "pixels"),
            ([*imported, "--intrinsics", "centre.yaml"], "centre.yaml: camera_matrix", "found 1e+300", "pixels"),
            ([options.sysid, "replay", "recording", *asset, "--tolerance", "1e300", "-o", "out"], "--tolerance", "1e300"),
            ([options.sysid, "grid", "recording", *asset, "--bending", "1e-4,2e-4", "--tolerance", "2", "-o", "out"],
             "--tolerance", "to 1"),
            ([options.sim, "bench", "--tolerance", "1e300"], "--tolerance", "to 1")):
        yield from refused(options, folder, words, *expected)


def check_device(options, folder):
    """--device cuda of verbs that no device does, and without one of those that it does."""
    for device in ("cuda", "cuda:0", "gpu"):
        yield from refused(options, folder, [options.sysid, "plan", "recording", "--asset", "asset.json", "-o", "out", "--device", device],
                           f'--device: found "{device}"', "auto or cpu", "on the CPU alone")
    yield from refused(options, folder, [options.sim, "bench", "--method", "projective", "--device", "cuda"],
                       '--device: found "cuda"', "auto or cpu", "--method projective runs on the CPU alone")
    # Without a device, whatever the machine has.
    hidden = dict(os.environ, CUDA_VISIBLE_DEVICES="")
    for words in (["bench"], ["run", "short.json", "-o", "out"]):
        yield from refused(options, folder, [options.sim, *words, "--device", "cuda"], "--device cuda", "CUDA",
                           "use --device cpu or auto", env=hidden)
    synth = [options.sysid, "synth", "--asset", "cloth.json", "--kind", "hang", "-o", "out", "--device"]
    yield from refused(options, folder, [*synth, "cuda"], "--device cuda", "CUDA", "use --device cpu or auto", env=hidden)
    yield from refused(options, folder, [*synth, "gpu"], "--device", "gpu")


def check_layers(options, folder):
    """--no-self-contact takes the layers of a scene away, and nothing else: its log is that of the scene without them."""
    layers, logs = folder / "layers.json", []
    layers.write_text(json.dumps(scene("cloth.json", self_contact={"thickness": 0.001, "friction": 0.3})))
    for words in ([layers], [layers, "--no-self-contact"], [folder / "short.json"]):
        program.must(options.sim, "run", *words, "--force", "-o", folder / "layered")
        logs.append((folder / "layered" / "log.csv").read_text())
    yield "layer_touches" in logs[0], "a scene with self_contact: no layers in log.csv"
    yield logs[1] == logs[2], "run --no-self-contact: not as the scene without self_contact"
    shutil.rmtree(folder / "layered")
    layers.unlink()


def check_names(options, folder):
    """Names of thousands of letters are said, but not in full."""
    name = "x" * 5000
    long = folder / "long"
    shutil.copytree(folder / "recording", long)
    content = json.loads((long / "recording.json").read_text())
    (long / "recording.json").write_text(json.dumps(content | {"kind": "hang", "name": name, name: 1}))
    for words in ([options.sim, "run", "long_name.json", "-o", "out"], [options.sim, "run", name, "-o", "out"],
                  [options.sim, name], [options.sim, "run", "short.json", "-o", "out", "--" + name], [options.sysid, "replay", "long",
                  "--asset", "asset.json", "-o", "out"], [options.sysid, "report", name], [options.sysid, "grid",
                  "recording", "--asset", "asset.json", "--hold", name + "=1", "--bending", "1e-4,2e-4", "-o", "out"]):
        yield from refused(options, folder, words, "xxx")
    del content["name"]
    others = []
    for number in (1, 2):
        others.append(folder / f"named_{number}")
        shutil.copytree(folder / "recording", others[-1])
        keyframes = content["keyframes"][:-number]
        (others[-1] / "recording.json").write_text(json.dumps(content | {"name": name, "keyframes": keyframes}))
    done = program.call(options.sysid, "grid", *others, "--asset", "asset.json", "--bending", "1e-4,2e-4",
                        "--no-solver-check", "--no-horizon", "-o", "named_run", cwd=folder)
    yield done.returncode in (0, 3), f"a search of long names: {done.returncode} {done.stderr[:300]}"
    yield "x" * 100 in done.stderr + done.stdout, "a search of long names: names nothing"
    for stream in (done.stderr, done.stdout):
        longest = max(map(len, stream.splitlines()), default=0)
        yield longest < 2200, f"a search of long names: a line of {longest} letters"
    for path in (*others, long, folder / "named_run"):
        shutil.rmtree(path)


def check_help(options, folder):
    """What an option takes: of one name, in each program its own."""
    expected = [([options.sysid, "synth"], {"--camera": "X,Y,Z", "--asset": "FILE", "--like": "PATH"})]
    if options.calib:
        expected += [([options.calib, "handeye"], {"--camera": "FILE", "--poses": "PATH", "--ros": "FILE", "--report": "FILE"}),
                     ([options.calib, "register"], {"--cameras": "FOLDER"})]
    for words, values in expected:
        text = program.must(*words, "--help").stdout
        for option, value in values.items():
            yield re.search(f"{option} {value}(,| |$)", text, re.MULTILINE), f"{words[1]} --help: not {option} {value}"
    text = program.must(options.sysid, "plan", "--help").stdout
    yield "--device DEVICE:{auto,cpu}=auto" in text and "cuda" not in text, f"plan --help: {text}"


def check_places(options, folder):
    """Places that cannot be written are found before the work begins, which is seen by what it would say."""
    (folder / "plain").write_text("mine")
    (folder / "empty").mkdir()
    search = ["recording", "--asset", "asset.json"]
    places = [("plain/out", "Not a directory"), ("/proc/out", "/proc/out: ")]
    for place, *expected in places:
        for words in (["fit", *search, "--start", "run"], ["replay", *search], ["plan", *search],
                      ["grid", *search, "--bending", "1e-4,2e-4"], ["synth", "--asset", "cloth.json"],
                      ["segment", "view"], ["export", "run"], ["report", "run"],
                      ["import", "recording/frames", "--trajectory", "recording/gripper.tum", "--mesh", "sheet:0.2x0.2:0.05:alternating"]):
            yield from refused(options, folder, [options.sysid, *words, "-o", place], place, *expected)
        yield from refused(options, folder, [options.sim, "run", "slow.json", "-o", place], place, *expected)
        if options.calib:  # the dataset is none, which is found later
            for words in (["detect", "."], ["handeye", "."], ["plan", "."], ["intrinsics", "."],
                          ["validate", ".", "--extrinsics", "view/extrinsics.json"]):
                yield from refused(options, folder, [options.calib, *words, "-o", place], place, *expected)
    for words in (["plan", *search], ["export", "run"], ["report", "run"]):
        yield from refused(options, folder, [options.sysid, *words, "-o", "empty"], "empty", "folder, expected a file")
    synth = [options.sysid, "synth", "--asset", "cloth.json", "--kind", "hang", "--duration", "0.1", "-o", "out"]
    for place, *expected in (("/", "folder, expected a file"), ("empty", "folder, expected a file"), *places,
                             ("plain", "exists already"), ("/dev/null", "exists already")):
        yield from refused(options, folder, [*synth, "--truth-out", place], place, *expected)
    yield (folder / "plain").read_text() == "mine", "--truth-out overwrites a file"


def check_calibration(options, folder):
    """--despite-doubts takes a camera that cannot be used; what stands on it says so, to the report."""
    words = [options.sysid, "import", "--depth", "view/depth", "--intrinsics", "view/camera_info.yaml", "--trajectory",
             "gripper.tum", "--times", "rate:2", "--mesh", "sheet:0.2x0.2:0.05:alternating", "--table-z", "0"]
    yield from refused(options, folder, [*words, "--extrinsics", "unusable.json", "-o", "lift"], "unusable.json",
                       "exit_code", "one axis only", "--despite-doubts")
    yield from refused(options, folder, [*words, "--extrinsics", "unusable.json", "--force", "-o", "lift"],
                       "exit_code", "--despite-doubts")
    yield from refused(options, folder, [*words, "--extrinsics", "partial.json", "--despite-doubts", "-o", "lift"],
                       "partial.json", "one_axis.told", "--target-height")
    expected = ["flash-calib handeye ended with exit code 3, an answer that cannot be used", "one axis only", "second"]
    for extrinsics, texts in (("unusable.json", expected), ("view/extrinsics.json", ["two views were left out"])):
        done = program.call(*words, "--extrinsics", extrinsics, "--despite-doubts", "--force", "-o", "lift", cwd=folder)
        yield done.returncode == 0, f"import --despite-doubts: exit code {done.returncode}: {done.stderr}"
        yield all(f"{extrinsics}: {text}" in done.stderr for text in texts), f"import --despite-doubts: {done.stderr}"
        camera = json.loads((folder / "lift" / "recording.json").read_text())["camera"]
        yield camera.get("warnings") == texts, f"recording.json keeps {camera.get('warnings')}"
        for verb, more in (("replay", []), ("grid", ["--bending", "1e-5,1e-4", "--no-solver-check", "--no-horizon"]),
                           ("fit", ["--start", "lift_grid", "--no-solver-check", "--no-horizon"])):
            done = program.call(options.sysid, verb, "lift", "--asset", "cloth.json", *more, "--force", "-o", f"lift_{verb}",
                                cwd=folder)
            yield done.returncode in (0, 3), f"{verb}: exit code {done.returncode}: {done.stderr}"
            for text in texts:
                line = f"flash-sysid: warning: lift: calibration of its camera: {text}\n"
                yield done.stderr.count(line) == 1, f"{verb} does not repeat once \"{text}\": {done.stderr}"
        summary = json.loads((folder / "lift_grid" / "summary.json").read_text())
        report = (folder / "lift_grid" / "report.html").read_text()
        for text in texts:
            yield any(text in warning for warning in summary["warnings"]), f"summary.json: {summary['warnings']}"
            yield text in report, f"report.html does not say \"{text}\""
    for name in ("lift", "lift_replay", "lift_grid", "lift_fit"):
        shutil.rmtree(folder / name, ignore_errors=True)


def check_guess(options, folder):
    """A table height that was guessed wrong lets the gripper miss the sheet; one that was given was not guessed."""
    words = [options.sysid, "import", "recording/frames", "--trajectory", "high.tum", "--times", "rate:10", "--mesh", "sheet:0.2x0.2:0.05:alternating", "--quiet", "-o", "out"]
    for guess, crop in (("0", "0:"), ("-0.1", "-0.1:")):
        yield from refused(options, folder, [*words, f"--crop-z={crop}"], "gripper", "should hold",
                           f"guessed as {guess} m", "--table-z")
    done = program.call(*words, "--crop-z=0:", "--table-z", "0", cwd=folder)
    yield done.returncode == REFUSED and "should hold" in done.stderr, f"import of a high gripper: {done.stderr}"
    yield "guessed" not in done.stderr, f"a table height that was given: {done.stderr}"


def check_digits(options, folder):
    """Spreads of narrow linear ranges: a uniform range of width w has w / sqrt(12)."""
    done = program.call(options.sysid, "plan", "recording", "--asset", "asset.json", "--poisson", "0.3:0.3001:2",
                        "--friction", "0.3:0.300002:2", "--bending", "1e-4:1.0001e-4:2:log", "--time-step", "0.02", "-o",
                        "plan.json", cwd=folder)
    yield done.returncode == 0, f"plan: exit code {done.returncode}: {done.stderr}"
    rows = [line.split() for line in done.stdout.splitlines() if "+-" in line]
    yield len(rows) >= 6, f"plan: {done.stdout}"
    spreads = [float(word) for row in rows for word in re.findall(r"\+-(\S+)", " ".join(row))]
    yield all(spread > 0 for spread in spreads), f"plan says that a value is known exactly: {done.stdout}"
    factors = [float(word) for row in rows for word in re.findall(r"x/: (\S+)", " ".join(row))]
    yield all(factor > 1 for factor in factors), f"plan says that a value is known exactly: {done.stdout}"
    alone = " ".join(next(line for line in done.stdout.splitlines() if line.startswith("(range alone)")).split())
    for width in (1e-4, 2e-6):
        expected = width / 12 ** 0.5  # printed with four digits
        yield (any(abs(float(word) - expected) < 1e-3 * expected for word in re.findall(r"\+-(\S+)", alone)),
               f"plan: range alone {alone}, expected {expected}")


def check_bags(options, folder):
    """A recording in place of a folder: the command that makes one of it."""
    for name in ("cell.bag", "cell.db3", "cell.mcap"):
        (folder / name).touch()
    (folder / "rosbag2").mkdir()
    (folder / "rosbag2" / "metadata.yaml").write_text("rosbag2_bagfile_information:\n  version: 9\n")
    for name in ("cell.bag", "cell.db3", "cell.mcap", "rosbag2"):
        calls = [([options.sysid, "segment", name, "-o", "out"], "segment"),
                 ([options.sysid, "import", name, "--trajectory", "gripper.tum", "--mesh", "sheet:0.2x0.2:0.05", "-o", "out"], "segment"),
                 ([options.sysid, "import", "--depth", name, "--trajectory", "gripper.tum", "--mesh", "sheet:0.2x0.2:0.05", "-o", "out"],
                  "segment")]
        if options.calib:
            calls += [([options.calib, verb, name, "--target", "chessboard:9x6:0.025", "-o", "out.json"], "handeye")
                      for verb in ("handeye", "intrinsics")]
        for words, reader in calls:
            yield from refused(options, folder, words, f"{name}: is a recording",
                               f"python -m flash_sim.bag {name} --for {reader} -o FOLDER")


def check_set_up(options, folder):
    """A scene of many vertices, set up for more than two seconds, says so; a small one does not."""
    for name, expected in (("slow.json", True), ("short.json", False)):
        done = program.call(options.sim, "run", name, "--steps", "0", "-o", "set_up", "--force", cwd=folder)
        said = "setting up" in done.stderr and "160,801 vertices" in done.stderr
        yield done.returncode == 0 and said == expected, f"run {name}: {done.returncode} {done.stderr}"
    done = program.call(options.sim, "run", "slow.json", "--steps", "0", "-o", "set_up", "--force", "--quiet", cwd=folder)
    yield "setting up" not in done.stderr, f"--quiet: {done.stderr}"
    shutil.rmtree(folder / "set_up")


def run_checks(description, what, checks):
    """Says how many statements of the checks hold, each of (options, folder); the exit code."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--sim", required=True, type=pathlib.Path, help="the program flash-sim")
    parser.add_argument("--sysid", required=True, type=pathlib.Path, help="the program flash-sysid")
    parser.add_argument("--calib", type=pathlib.Path, help="the program flash-calib")
    parser.add_argument("--only", default="", help="checks whose name has this")
    options = parser.parse_args()
    done, failed = 0, 0
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        asset, recording = program.synthesize(options.sysid, folder)
        write_inputs(folder)
        program.must(options.sysid, "grid", recording, "--asset", asset, "--bending", "5e-5,1e-4,2e-4",
                     "--no-solver-check", "--no-horizon", "--quiet", "-o", folder / "run")
        for check in checks:
            for holds, complaint in check(options, folder) if options.only in check.__name__ else ():
                done += 1
                failed += not holds
                if not holds:
                    print(f"{check.__name__}: {complaint}", flush=True)
    print(f"{done - failed} of {done} statements about {what} hold")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(run_checks(__doc__, "misuse", [
        check_config, check_words, check_units, check_unusable, check_values, check_device, check_layers, check_names, check_help,
        check_places, check_calibration, check_guess, check_digits, check_bags, check_set_up]))
