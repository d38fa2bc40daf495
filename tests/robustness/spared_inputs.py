#!/usr/bin/env python3
"""--force writes over former results, never over what a verb reads: of every verb of flash-sysid and flash-sim that writes,
each kind of input and each way to name it. flash-calib's are tried in calib_files.py. What is no input is still written over."""
import argparse
import json
import os
import pathlib
import shutil
import sys
import tempfile

import program
from calib_files import digests

REFUSED = 2
SEARCH = ["--bending", "5e-5,1e-4,2e-4", "--no-solver-check", "--no-horizon", "--no-plan", "--quiet"]


def write_inputs(sysid, sim, work):
    asset, recording = program.synthesize(sysid, work)
    program.must(sysid, "grid", recording, "--asset", asset, *SEARCH, "-o", work / "run")
    shutil.copytree(recording, work / "rec2")
    shutil.copytree(recording, work / "other")
    shutil.copytree(work / "run", work / "run2")
    (work / "raw/frames").mkdir(parents=True)
    for k, cloud in enumerate(sorted((recording / "frames").glob("*.ply"))):
        shutil.copy(cloud, work / "raw/frames" / f"{k:03d}.ply")
    (work / "scan.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (work / "meshed.json").write_text(json.dumps(program.ASSET | {"mesh": "scan.obj"}))
    (work / "scene.json").write_text(json.dumps(
        {"schema": "flash-scene/1", "timestep": 0.01, "steps": 1, "gravity": [0, 0, -9.81], "objects": {"cloth": "meshed.json"}}))
    (work / "scene.txt").write_text((work / "scene.json").read_text().replace("meshed.json", "holds/asset.json"))
    (work / "marked.json").write_bytes(b"\xef\xbb\xbf" + (work / "scene.txt").read_bytes())
    (work / "options.toml").write_text("[plan]\nseed=1\n")
    (work / "links").mkdir()
    (work / "links/rec").symlink_to("../rec2")
    (work / "links/asset.json").symlink_to("../asset.json")
    os.link(work / "rec2/gripper.tum", work / "links/hard.tum")
    (work / "holds").mkdir()
    shutil.copy(work / "asset.json", work / "holds/asset.json")
    (work / "links/other").symlink_to("../other")
    (work / "own.json").write_text(json.dumps(program.ASSET))
    (work / "published.json").write_text(json.dumps({k: v for k, v in program.ASSET.items() if k != "schema"}))
    (work / "leads").mkdir()
    (work / "leads/frames").symlink_to("../rec2/frames")
    (work / "former").mkdir()
    (work / "former/note.txt").write_text("mine")
    (work / "former.json").write_text("{}")
    (work / "foreign").mkdir()
    (work / "foreign/recording.json").write_text('{"results": ["tuned.json"]}')


def overwrites(sysid, sim):
    """Command line, and what its one line says: the path that is spared, and the one under it."""
    asset = ["--asset", "asset.json"]
    for words in (["predict", "run", "rec2"], ["plan", "rec2", *asset], ["plan", "rec2", *asset, "--run", "run"]):
        for path in ("rec2/recording.json", "rec2/gripper.tum", "rec2/frames/000.ply", "links/rec/recording.json",
                     "rec2/../rec2/recording.json", "./rec2//gripper.tum", "links/hard.tum", "{work}/rec2/recording.json"):
            yield [sysid, *words, "-o", path], f"{path}: is read by this run"
    for path in ("run/summary.json", "run/grid.json", "run/results.csv", "run/registrations.csv", "run/keyframes.csv",
                 "run/residuals.csv", "asset.json", "links/asset.json"):
        for words in (["predict", "run", "rec2"], ["export", "run"], ["report", "run"], ["compare", "run", "run2"]):
            yield [sysid, *words, "-o", path], f"{path}: is read by this run"
    yield [sysid, "compare", "run", "run2", "-o", "run2/summary.json"], "run2/summary.json: is read by this run"
    yield [sysid, "report", "run", "-o", "run/best/recording/overlay.csv"], "is read by this run"
    yield [sysid, "export", "run", "--asset", "meshed.json", "-o", "meshed.json"], "meshed.json: is read by this run"
    yield [sysid, "export", "run", "--asset", "meshed.json", "-o", "scan.obj"], "scan.obj: is read by this run"
    yield [sysid, "--config", "options.toml", "plan", "rec2", *asset, "-o", "options.toml"], "options.toml: is read"
    # What this run does not read, and others would: no result takes its place either.
    mesh = ["mesh", "scan.obj"]
    for path, said in (("other/recording.json", "is part of the recording in {work}/other"),
                       ("other/gripper.tum", "is part of the recording in {work}/other"),
                       ("links/other/camera_info.yaml", "is part of the recording in {work}/other"),
                       ("other/frames/000.ply", "is part of the recording in {work}/other"),
                       ("run2/results.csv", "is part of the search in {work}/run2"), ("scene.json", "is a scene")):
        for words in ([sysid, "export", "run"], [sysid, "report", "run"], [sysid, "predict", "run", "rec2"],
                      [sysid, "plan", "rec2", *asset], [sim, *mesh], [sim, "picture", "scan.obj"]):
            yield [*words, "-o", path], f"{path}: {said}, expected another file for the result"
        yield [sim, *mesh, "-o", "new.obj", "--flat", path], f"{path}: {said}"
        yield [sysid, "synth", *asset, "-o", "new", "--truth-out", path], f"{path}: {said}"
    for path in ("own.json", "published.json"):
        for words in (["report", "run"], ["predict", "run", "rec2"], ["compare", "run", "run2"]):
            yield [sysid, *words, "-o", path], f"{path}: is an asset, expected another file for the result"
    for words in (["synth", *asset, "-o", "new"], ["synth", *asset, "-o", "former"]):
        for path in ("asset.json", "links/asset.json"):
            yield [sysid, *words, "--truth-out", path], f"{path}: is read by this run"
    for path in ("new/recording.json", "new/frames/000.ply", "./new/gripper.tum", "former/recording.json"):
        yield [sysid, "synth", *asset, "-o", path.removeprefix("./").split("/")[0], "--truth-out", path], f"--truth-out: found {path}"
    yield [sysid, "synth", *asset, "-o", "new", "--truth-out", "new"], "named twice"
    # Folders: the input itself, one that holds it, one that a link in it leads to.
    for out, held in (("rec2", "rec2/recording.json"), ("rec2/", "rec2/recording.json"), ("rec2/frames", "rec2/frames/"),
                      ("links/rec", "rec2/recording.json"), (".", "rec2/recording.json"), ("leads", "rec2/frames/")):
        for words in (["grid", "rec2", *asset, *SEARCH], ["fit", "rec2", "--start", "run"], ["replay", "rec2", *asset]):
            yield [sysid, *words, "-o", out], f"{out}: holds {held}"
    yield [sysid, "grid", "rec2", "--asset", "holds/asset.json", *SEARCH, "-o", "holds"], "holds: holds holds/asset.json"
    yield [sysid, "synth", "--asset", "holds/asset.json", "-o", "holds"], "holds: holds holds/asset.json"
    yield [sysid, "fit", "rec2", "--start", "run", "-o", "run"], "run: holds run/grid.json"
    yield [sysid, "replay", "rec2", *asset, "-o", "run/../rec2"], "run/../rec2: holds rec2/recording.json"
    yield [sysid, "segment", "raw", "--no-table", "-o", "raw"], "raw: holds raw/frames/000.ply"
    imported = ["import", "rec2/frames", "--trajectory", "rec2/gripper.tum", "--times", "rate:10", "--mesh",
                "sheet:0.2x0.2:0.05:alternating"]
    yield [sysid, *imported, "-o", "rec2"], "rec2: holds rec2/"
    yield [sim, "run", "scene.json", "-o", "."], ".: holds scene.json"
    # A recording that this run does not read.
    for words in ([sim, "run", "scene.json"], [sysid, "segment", "raw", "--no-table"], [sysid, "replay", "rec2", *asset],
                  [sysid, "grid", "rec2", *asset, *SEARCH]):
        for out in ("other", "links/other/"):
            yield [*words, "-o", out], f"{out}: holds a recording, expected another folder for the result"
    for scene in ("scene.txt", "marked.json"):
        yield [sim, "run", scene, "-o", "holds"], "holds: holds holds/asset.json"
    for words in (["picture", "scan.obj", "-o", "scan.obj"], ["mesh", "scan.obj", "-o", "scan.obj"],
                  ["mesh", "scan.obj", "-o", "new.obj", "--flat", "./scan.obj"]):
        yield [sim, *words], "scan.obj: is read by this run"
    yield [sim, "mesh", "scan.obj", "-o", "new.obj", "--flat", "./new.obj"], "named twice"


def check_refused(options, work):
    before = digests(work)
    for words, expected in overwrites(options.sysid, options.sim):
        words = [str(word).replace("{work}", str(work)) for word in words]
        expected = expected.replace("{work}", str(work))
        where = " ".join(words[1:])
        for force in (["--force"], []):
            done = program.call(*words, *force, cwd=work, timeout=60)
            yield done.returncode == REFUSED, f"{where} {force}: exit code {done.returncode}: {done.stderr[-500:]}"
            lines = done.stderr.splitlines()
            yield len(lines) == 1 and expected in lines[0], f"{where} {force}: does not say {expected}: {lines}"
            after = digests(work)
            changed = sorted(name for name in before.keys() | after.keys() if before.get(name) != after.get(name))
            yield not changed, f"{where} {force}: changed {changed}"
            if changed:
                sys.exit(f"{where}: changed {changed}: nothing else can be tried")
    # Without --force it is --resume that goes on in a folder.
    done = program.call(options.sysid, "fit", "rec2", "--start", "run", "-o", "run", "--resume", cwd=work)
    yield done.returncode == REFUSED and "run: holds run/grid.json" in done.stderr, f"fit --resume: {done.stderr}"
    yield digests(work) == before, "fit --resume changes what it reads"


def check_written(options, work):
    """Former results, and names beside what is read."""
    sysid, sim, asset = options.sysid, options.sim, ["--asset", "asset.json"]
    for words in (["grid", "rec2", *asset, *SEARCH, "--resume", "-o", "run"],
                  ["grid", "rec2", *asset, *SEARCH, "-o", "rec2/search"], ["predict", "run", "rec2", "-o", "run/former.json"],
                  ["export", "run", "-o", "run/tuned.json"], ["export", "run", "-o", "former.json"],
                  ["export", "run", "-o", "own.json"],
                  ["report", "run", "-o", "run/report.html"], ["compare", "run", "run2", "-o", "run/comparison.json"],
                  ["replay", "rec2", *asset, "-o", "former"], ["replay", "rec2", *asset, "-o", "rec2/overlay"],
                  ["synth", *asset, "--duration", "0.2", "-o", "former", "--truth-out", "former/mine.json"],
                  # Words that are a folder's name, and documents of others.
                  ["synth", *asset, "--duration", "0.2", "--kind", "hang", "-o", "hang"],
                  ["replay", "rec2", *asset, "--grasp-shape", "point", "-o", "point"],
                  ["replay", "rec2", *asset, "--device", "cpu", "-o", "cpu"],
                  ["export", "run", "-o", "foreign/tuned.json"], ["compare", "run", "run2", "-o", "named/summary.json"]):
        for time in range(2):
            force = [] if "--resume" in words else ["--force"]
            done = program.call(sysid, *words, *force, cwd=work)
            yield done.returncode in (0, 3), f"{' '.join(words)}, time {time + 1}: {done.returncode} {done.stderr[-500:]}"
    for words in (["picture", "scan.obj", "-o", "former.png"], ["run", "scene.json", "-o", "ran"]):
        for time in range(2):
            done = program.call(sim, *words, "--force", cwd=work)
            yield done.returncode in (0, 3), f"{' '.join(words)}, time {time + 1}: {done.returncode} {done.stderr[-500:]}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sim", required=True, help="the program flash-sim")
    parser.add_argument("--sysid", required=True, help="the program flash-sysid")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        work = pathlib.Path(temporary).resolve()
        write_inputs(options.sysid, options.sim, work)
        results = list(check_refused(options, work)) + list(check_written(options, work))
    sys.exit(program.conclude(results))


if __name__ == "__main__":
    main()
