"""Pages of the site that stand in no file of docs/: options of the programs, classes of the package, notebooks with what they print
and draw, sources that a page links to.

MkDocs calls the functions named on_*. scripts/site gives the folder of the programs, FLASH_BIN.
"""
import base64
import json
import os
import pathlib
import posixpath
import re
import subprocess

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File

ROOT = pathlib.Path(__file__).resolve().parents[1]
PROGRAMS = ("flash-calib", "flash-sysid", "flash-sim")
# Files outside of docs/ that are pages.
PAGES = {"CHANGELOG.md": "changelog.md", "CONTRIBUTING.md": "contributing.md", "README.md": "readme.md"}
LINK = re.compile(r"\[([^\[\]]*)\]\(([^)\s#]+)(#[^)\s]*)?\)")
LANGUAGES = {".h": "cpp", ".cpp": "cpp", ".py": "python", ".json": "json"}


def helped(*words):
    """What a program prints with --help, its path left out."""
    program = pathlib.Path(os.environ["FLASH_BIN"]) / words[0]
    try:
        done = subprocess.run([program, *words[1:], "--help"], check=True, capture_output=True, text=True)
    except (OSError, subprocess.CalledProcessError) as error:
        raise PluginError(f"{' '.join(words)} --help: {error}; `make site` builds the programs") from error
    return done.stdout.replace(str(program), words[0]).strip()


def program_page(name):
    general = helped(name)
    listed = re.split(r"(?m)^S(?:ubcommands|UBCOMMANDS):.*\n", general)[-1]
    verbs = re.findall(r"(?m)^  ([a-z]+)  ", listed)
    if not verbs:
        raise PluginError(f"{name} --help lists no verb")
    parts = [f"# {name}\n\nWhat `--help` prints, of the program and of each verb.\n\n```text\n{general}\n```\n"]
    parts += [f"## {verb}\n\n```text\n{helped(name, verb)}\n```\n" for verb in verbs]
    return "\n".join(parts)


def python_page():
    return ("# Classes and functions\n\nThe docstrings of both packages. How they are used stands in [Python](../python.md).\n\n" +
            "\n\n".join(f"::: flash_sim.{name}" for name in (
                "realtime_sim.RealtimeSim", "asset.Asset", "sysid.load", "sysid.Recording", "sysid.replay", "sysid.Motion",
                "sysid.distances", "sysid.Distances", "sysid.Likelihood", "sysid.answer", "sysid.Answer", "sysid.parameters",
                "device_array.DeviceArray", "device_array.to_host",
                "cameras.look_at", "depth_noise.DepthNoise", "depth_noise.add_depth_noise", "depth_noise.jitter_poses",
                "folds.Fold", "tasks.FoldSettings", "tasks.FoldTask", "gym.FoldVectorEnv", "rsl.FoldVecEnv")) + "\n\n" +
            "\n\n".join(f"::: flash_calib.{name}" for name in (
                "handeye.handeye_pairs", "handeye.handeye_corners", "handeye.target_points", "results.load", "results.Calibration",
                "results.HeldOut", "results.Noise", "results.Size", "results.Weakest", "results.Lens", "cameras.Camera",
                "cameras.load_camera")) + "\n")


def cpp_page():
    """The doors of each library, by their headers; the rest is Doxygen's."""
    rows = ["| folder | its headers |", "|---|---|"]
    for folder in sorted({path.parent for module in ("data", "sim", "calib", "sysid") for path in (ROOT / module).glob("*/*.h")}):
        names = [f"`{path.name}`" for path in sorted(folder.glob("*.h"))]
        rows.append(f"| {folder.relative_to(ROOT)} | {' '.join(names)} |")
    return ("# C++\n\nThe libraries are `flash::data`, `flash::sim`, `flash::calib` and `flash::sysid`. A header is the page a "
            "reader stops at: what it is, its equation, units, shapes, errors, source. "
            "<a href=\"../cpp/annotated.html\">All classes</a> and <a href=\"../cpp/files.html\">all headers</a> are "
            "Doxygen's.\n\n" + "\n".join(rows) + "\n")


def notebook_page(path):
    """The page of a notebook, as tests/python/test_notebooks.py has run it, and its pictures by name."""
    done = ROOT / "build" / "notebooks" / path.name
    shown = json.loads(done.read_text(encoding="utf-8")) if done.is_file() else {"cells": []}
    if ["".join(cell["source"]) for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]] != [
            "".join(cell["source"]) for cell in shown["cells"]]:
        raise PluginError(f"{path.name}: found another one, or none, in build/notebooks; scripts/site runs those that have changed")
    parts, pictures = [], {}
    for cell in shown["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(source)
            continue
        parts.append(f"````python\n{source}\n````")
        text = ""
        for output in cell["outputs"]:
            text += "".join(output.get("text", []))
            if "image/png" in output.get("data", {}):
                name = f"{path.stem}_{len(pictures)}.png"
                pictures[name] = base64.b64decode("".join(output["data"]["image/png"]))
                parts.append(f"![A picture that the cell draws]({name})")
        if text:
            parts.append(f"````text\n{text.rstrip()}\n````")
    parts.insert(1, f'<a href="{path.name}" download>The notebook</a> without what it prints and draws.')
    return "\n\n".join(parts) + "\n", pictures


def outside(page, target):
    """The path of a link from the root of the checkout, where it leaves docs/; else None."""
    path = posixpath.normpath(posixpath.join("docs", posixpath.dirname(page), target))
    return None if re.match(r"[a-z]+:", target) or path.startswith("docs/") else path


def source_page(path):
    return f"source/{path}.md"


def on_files(files, config):
    def add(uri, content):
        files.append(File.generated(config, uri, content=content))

    for name in PROGRAMS:
        add(f"reference/{name}.md", program_page(name))
    add("reference/python.md", python_page())
    add("reference/cpp.md", cpp_page())
    for path in sorted((ROOT / "docs" / "notebooks").glob("*.ipynb")):
        text, pictures = notebook_page(path)
        add(f"notebooks/{path.stem}.md", text)
        for name, picture in pictures.items():
            add(f"notebooks/{name}", picture)
    linked = set()
    for file in files.documentation_pages():
        linked |= {outside(file.src_uri, match[2]) for match in LINK.finditer(file.content_string)}
    for path, uri in PAGES.items():
        text = (ROOT / path).read_text()
        linked |= {posixpath.normpath(match[2]) for match in LINK.finditer(text)}
        add(uri, text)
    for path in sorted(linked - {None, *PAGES}):
        if (ROOT / path).is_file() and not path.startswith("docs/"):
            language = LANGUAGES.get(pathlib.Path(path).suffix, "text")
            add(source_page(path), f"# {path}\n\n````{language}\n{(ROOT / path).read_text().rstrip()}\n````\n")
    return files


def on_page_markdown(markdown, page, config, files):
    """Links that leave docs/, or to a notebook, lead to the pages made here. Those of files at the root are as seen from there."""
    here = page.file.src_uri
    at_root = here in PAGES.values()

    def moved(match):
        text, target, anchor = match[1], match[2], match[3] or ""
        if re.match(r"[a-z]+:", target):
            return match[0]
        target = re.sub(r"\.ipynb$", ".md", target)
        path = posixpath.normpath(target) if at_root else outside(here, target)
        if path is None or (ROOT / path).is_dir():
            return f"[{text}]({target}{anchor})" if path is None else text  # a folder is no page
        to = path[len("docs/"):] if path.startswith("docs/") else PAGES.get(path, source_page(path))
        return f"[{text}]({posixpath.relpath(to, posixpath.dirname(here) or '.')}{anchor})"

    return LINK.sub(moved, markdown)


SHIM = "https://unpkg.com/iframe-worker/shim"


def on_post_page(output, page, config):
    """Nothing is fetched from another server: what makes the search work on files stands in docs/assets."""
    if SHIM not in output:
        raise PluginError(f"{page.file.src_uri}: does not load {SHIM}, which is replaced: another version of the theme?")
    return output.replace(SHIM, posixpath.relpath("assets/worker_of_files.js", posixpath.dirname(page.file.dest_uri) or "."))


def on_post_template(output_content, template_name, config):
    return output_content.replace(SHIM, "/assets/worker_of_files.js")
