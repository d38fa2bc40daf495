#!/usr/bin/env python3
"""Wrong words, ranges and quantities that no recording has, for every verb of flash-sysid and flash-sim that has such an
option: refused in one line that names it, before anything is written."""
import argparse
import json
import pathlib
import shutil
import sys
import tempfile

import program
from calib_files import digests

REFUSED = 2
MESHES = {"disc:": "disc:RADIUS:CELL", "disc:0.1:0.2": "at most the radius", "sheet:0.2x0.2": "sheet:WIDTHxHEIGHT:CELL",
          "sheet:0.2x0.2:0": "sheet:WIDTHxHEIGHT:CELL", "sheet:0.2x0.2:0.3": "at most the shorter side",
          "sheet:nanx0.2:0.05": "sheet:WIDTHxHEIGHT:CELL", "sheet:0.2x0.2:0.05:even": "expected pattern"}
RANGES = {"1:1e-4:3": "low", "1e-4:1:0": "count", "nan,1": "nan", "0:1:3:log": "logarithmic", "1e-4": "one value", "1e-4,a": "a"}
UNSEEN = ("force=0.02", "markers=0.002", "contour=0.002")


def write_inputs(sysid, work):
    asset, recording = program.synthesize(sysid, work)
    program.must(sysid, "grid", recording, "--asset", asset, "--bending", "5e-5,1e-4,2e-4", "--no-solver-check", "--no-horizon",
                 "--no-plan", "--quiet", "-o", work / "run")
    program.must(sysid, "synth", "--asset", asset, "--mesh", "sheet:0.24x0.2:0.05:alternating", "--duration", "0.3", "--quiet",
                 "-o", work / "larger")
    heavy = program.ASSET | {"mechanical_props": program.ASSET["mechanical_props"] | {"areal_density": 0.3}}
    (work / "heavy.json").write_text(json.dumps(heavy))


def verbs(sysid):
    asset = ["--asset", "asset.json"]
    return {"grid": [sysid, "grid", "recording", *asset, "--bending", "1e-5,1e-4", "-o", "new/run"],
            "replay": [sysid, "replay", "recording", *asset, "-o", "new/overlay"],
            "fit": [sysid, "fit", "recording", "--start", "run", "-o", "new/fit"],
            "plan": [sysid, "plan", "recording", *asset, "-o", "new/plan.json"],
            "plan --run": [sysid, "plan", "recording", "--run", "run", "-o", "new/plan.json"],
            "predict": [sysid, "predict", "run", "recording", "-o", "new/prediction.json"]}


def refused(sysid, sim):
    """Command lines, and what their one line says."""
    asset = ["--asset", "asset.json"]
    for mesh, said in MESHES.items():
        for words in verbs(sysid).values():
            yield [*words, "--mesh", mesh], ("--mesh: found", said)
        yield [sysid, "synth", *asset, "--mesh", mesh, "-o", "new/synth", "--truth-out", "new/truth.json"], ("--mesh: found", said)
        yield [sysid, "import", "recording/frames", "--trajectory", "recording/gripper.tum", "--times", "rate:10", "--mesh", mesh,
               "-o", "new/import"], ("--mesh: found", said)
        yield [sim, "mesh", mesh, "-o", "new/mesh.obj"], ("mesh: found", said)
    for values, said in RANGES.items():
        for verb in ("grid", "plan"):
            words = [word for word in verbs(sysid)[verb] if word not in ("--bending", "1e-5,1e-4")]
            yield [*words, "--bending", values], ("--bending", said)
    for words in verbs(sysid).values():
        yield [*words, "--sigma", "CLOUD=0.02"], ('--sigma: "CLOUD=0.02": expected cloud, contour, markers or force',)
        for sigma in UNSEEN:
            yield [*words, "--sigma", sigma], (f"--sigma {sigma}: found no {sigma.split('=')[0]}", "recording/recording.json")
        yield [*words, "--share", "yaw"], ("--share yaw: found one recording",)
    # What a search knows is of its object.
    for words in (["plan", "larger", "--run", "run", "-o", "new/plan.json"], ["fit", "larger", "--start", "run", "-o", "new/fit"],
                  ["predict", "run", "larger", "-o", "new/prediction.json"]):
        yield [sysid, *words], ("larger/recording.json: object.mesh: found an object", "that of run is")
    # A name that goes through a folder which is not there yet is the file all the same.
    yield [sysid, "synth", *asset, "-o", "new/synth", "--truth-out", "none/../heavy.json"], ("heavy.json: is an asset",)
    yield [sysid, "export", "run", "-o", "none/../run/report.html"], ("none/../run/report.html",)
    yield [sysid, "export", "run", "-o", "none/../tuned.json"], ("none/../tuned.json: exists already",)
    yield [sim, "mesh", "sheet:0.2x0.2:0.05", "--edge", "0.01", "-o", "new/mesh.obj"], ("--edge: is of scans",)


def check(options, work):
    (work / "tuned.json").write_text("{}")
    before = digests(work)
    for words, expected in refused(options.sysid, options.sim):
        done = program.call(*words, cwd=work, timeout=60)
        where = " ".join(map(str, words[1:]))
        yield done.returncode == REFUSED, f"{where}: exit code {done.returncode}: {done.stderr[-500:]}"
        lines = [line for line in done.stderr.splitlines() if "warning:" not in line]
        yield len(lines) == 1 and all(text in lines[0] for text in expected), f"{where}: does not say {expected}: {lines}"
        yield not (work / "new").exists() and not (work / "none").exists(), f"{where}: makes a folder"
        for folder in ("new", "none"):
            shutil.rmtree(work / folder, ignore_errors=True)
    yield digests(work) == before, "what was there has changed"


def check_taken(options, work):
    """What stands beside the wrong words and is right."""
    sysid = options.sysid
    done = program.call(sysid, "plan", "recording", "--run", "run", "--asset", "heavy.json", "-o", "other.json", cwd=work)
    yield done.returncode == 0 and "--asset: areal_density: found 0.3, the search had 0.2" in done.stderr, f"plan: {done.stderr}"
    done = program.call(sysid, "plan", "recording", "--run", "run", "-o", "same.json", cwd=work)
    yield done.returncode == 0 and "the search had" not in done.stderr, f"plan: {done.stderr}"
    done = program.call(sysid, "plan", "recording", "--asset", "asset.json", "--mesh", "sheet:0.2x0.2:0.05", "-o", "even.json", cwd=work)
    yield done.returncode == 0, f"plan --mesh without a pattern: {done.stderr}"
    done = program.call(sysid, "replay", "recording", "--asset", "asset.json", "--sigma", "cloud=0.002", "--two-sided",
                        "-o", "overlay", cwd=work)
    yield done.returncode == 0, f"replay: {done.stderr}"
    for name, vertices in (("sheet:0.4x0.2:0.1:one_way", 15), ("disc:0.2:0.1", 19)):
        done = program.call(options.sim, "mesh", name, "--force", "-o", "made.obj", cwd=work)
        text = (work / "made.obj").read_text() if done.returncode == 0 else done.stderr
        yield sum(line.startswith("v ") for line in text.splitlines()) == vertices, f"mesh {name}: {text[:200]}"
    done = program.call(options.sim, "mesh", "box:0.2x0.1x0.1:0.1", "-o", "made.tet", cwd=work)
    yield done.returncode == 0 and "12 vertices, 10 tetrahedra" in done.stdout, f"mesh of a box: {done.stdout} {done.stderr}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sim", required=True, help="the program flash-sim")
    parser.add_argument("--sysid", required=True, help="the program flash-sysid")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        work = pathlib.Path(temporary).resolve()
        write_inputs(options.sysid, work)
        results = list(check(options, work)) + list(check_taken(options, work))
    sys.exit(program.conclude(results))


if __name__ == "__main__":
    main()
