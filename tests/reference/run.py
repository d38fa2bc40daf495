#!/usr/bin/env python3
"""Runs reference scenes with flash-sim and writes, a scene each, RESULTS/<scene>.json with the positions, frames and
quantities that the scene's judge asks for."""
import argparse
import concurrent.futures
import json
import pathlib
import subprocess
import sys
import time

import quantities
import scene_files

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "validation"))
import reference  # noqa: E402

TABLES = ("elastica_table", "cantilever_convergence")
REFINEMENTS = 3, 4  # of the solid cantilever; linear elements: errors go with the square of the cell


def names(scenes):
    return sorted(path.stem for path in scenes.glob("*.json")
                  if path.stem not in TABLES)


def read_vertices(path):
    return [tuple(map(float, line.split()[1:4])) for line in path.read_text().splitlines() if line.startswith("v ")]


def simulate(scene, rest, folder, scenes, sim):
    """What flash-sim wrote of a scene, and said on stderr."""
    path = scene_files.write(scene, rest, folder, scenes)
    done = subprocess.run([sim, "run", str(path), "-o", str(folder / "out"), "--force", "--quiet", "--threads", "1"],
                          capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"exit code {done.returncode}: {done.stderr.strip()}")
    return quantities.Output(folder / "out"), done.stderr.strip()


def limit_of_refinement(scene, folder, scenes, sim):
    """The tip's drop on two finer meshes, extrapolated to none of their errors."""
    drops = []
    for times in REFINEMENTS:
        finer, rest = scene_files.refined_cantilever(scene, times, folder / f"refined{times}")
        output, _ = simulate(finer, rest, folder / f"refined{times}", scenes, sim)
        drops.append(quantities.tip_drop(rest, output))
    coarse, fine = drops
    return fine + (fine - coarse) / ((REFINEMENTS[1] / REFINEMENTS[0]) ** 2 - 1)


def solve(name, scenes, results, sim):
    scene = json.loads((scenes / f"{name}.json").read_text())
    rest = read_vertices(scenes / scene["mesh"])
    folder = results / "runs" / name
    begin = time.monotonic()
    output, warnings = simulate(scene, rest, folder, scenes, sim)
    result = {}
    expected = None
    if "frames" in scene:
        expected = {t: scene_files.read_points(scenes / frame["positions"]) for t, frame in scene["frames"].items()
                     if float(t) <= scene_files.LIFT_SECONDS}
        result["frames"] = {t: output.frame(round(float(t) / scene["dt"])) for t in expected}
    elif "reference_positions" in scene:
        expected = scene_files.read_points(scenes / scene["reference_positions"])
        result["positions"] = output.last
    found = quantities.of(scene, rest, output, expected)
    if scene_files.is_solid(scene) and "fixed" in scene:
        found["extrapolated limit vs Timoshenko"] = limit_of_refinement(scene, folder, scenes, sim)
    wanted = [entry["quantity"] for entry in scene["expected"]]
    unknown = [quantity for quantity in wanted if quantity not in found]
    if unknown:
        raise RuntimeError(f"no such quantity here: {', '.join(unknown)}")
    result["quantities"] = {quantity: found[quantity] for quantity in wanted}
    (results / f"{name}.json").write_text(json.dumps(result))
    return name, time.monotonic() - begin, warnings


def solved(name, *arguments):
    """What solve returns, or the reason why a scene has no result: the others have theirs all the same."""
    try:
        return *solve(name, *arguments), ""
    except (RuntimeError, OSError, KeyError, ValueError) as error:
        return name, 0.0, "", f"{type(error).__name__}: {error}"


def main(words=None):
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sim", required=True, help="the program flash-sim")
    parser.add_argument("--scenes", type=pathlib.Path, default=pathlib.Path(__file__).parent / "scenes",
                        help="folder of the reference scenes")
    parser.add_argument("--out", required=True, type=pathlib.Path, help="folder of the results")
    parser.add_argument("--jobs", type=int, default=1, help="scenes at once")
    parser.add_argument("--judge", action="store_true", help="fail where a quantity is farther off than allowed")
    parser.add_argument("scene", nargs="*", help="these alone")
    options = parser.parse_args(words)
    options.out.mkdir(parents=True, exist_ok=True)
    failed = False
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        runs = pool.map(lambda name: solved(name, options.scenes, options.out, options.sim),
                        options.scene or names(options.scenes))
        for name, seconds, warnings, reason in runs:
            if reason:
                failed = True
                print(f"          {name}  no result: {reason}", flush=True)
                continue
            print(f"{seconds:6.1f} s  {name}  {warnings}".rstrip(), flush=True)
            for quantity, value, wanted, error, allowed in reference.rows_of(name, options.scenes, options.out):
                if options.judge and not error <= allowed:
                    failed = True
                    print(f"  {quantity}: found {value!r}, expected {wanted!r} within {allowed:.3g}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
