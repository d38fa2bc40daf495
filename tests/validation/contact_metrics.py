#!/usr/bin/env python3
"""What the inexact metric of the published method costs, beside its full metric and the exact solver: how deep a sheet sinks
into a sloped rail, how fast it creeps along it, and how far the rail's force is from the weight."""
import argparse
import csv
import json
import math
import pathlib
import subprocess
import sys

from surface import read_ply

SIDE, CELLS, RADIUS, SLOPE, FRICTION = 0.2, 10, 0.01, 0.2, 0.5  # [m], -, [m], [rad], -
DENSITY, STEP, SETTLED, END = 0.2, 0.01, 1.0, 2.0  # [kg/m^2], [s], [s], [s]
# Name, type of the contact solver (none: Newton's method), iterations of both kinds.
METHODS = (("exact", None, 60), ("full metric", "NonSmoothNewton", 10), ("inertia metric", "LiteNonSmoothNewton", 10),
           ("inertia metric", "LiteNonSmoothNewton", 30), ("inertia metric", "LiteNonSmoothNewton", 100))


def scene(folder, kind, iterations):
    """Files of a sheet that hangs over a rail."""
    folder.mkdir(parents=True, exist_ok=True)
    asset = {"schema": "flash-asset/1", "mesh": f"sheet:{SIDE}x{SIDE}:{SIDE / CELLS}", "element_type": "TRIANGLE",
             "mechanical_props": {"areal_density": DENSITY, "young": 200, "poisson": 0.3, "constitutive": "TRI_COROTATED",
                                  "bending_rigidity": 1e-4, "bending_model": "isometric", "air_drag": 10}}
    solver = {"type": "projective", "iterations": iterations} if kind else {"type": "newton", "iterations": iterations}
    text = {"schema": "flash-scene/1", "timestep": STEP, "duration": END, "solver": solver,
            "gravity": [0, 9.81 * math.sin(SLOPE), -9.81 * math.cos(SLOPE)], "keyframes": [SETTLED, END],
            "obstacles": {"rail": {"shape": "cylinder", "point": [SIDE / 2, 0, -RADIUS], "axis": [0, 1, 0], "radius": RADIUS,
                                   "friction": FRICTION}},
            "objects": {"sheet": {"asset": "asset.json"}}}
    if kind:
        text["constraintsolver"] = {"type": kind, "iterations": iterations}
    (folder / "asset.json").write_text(json.dumps(asset))
    (folder / "scene.json").write_text(json.dumps(text))
    return folder / "scene.json"


def row(sim, out, name, kind, iterations):
    folder = out / f"{kind}_{iterations}"
    # 3: steps were not solved, which the table says.
    done = subprocess.run([sim, "run", str(scene(folder, kind, iterations)), "-o", str(folder / "run"), "--force", "--quiet"],
                          capture_output=True, text=True)
    if done.returncode not in (0, 3):
        sys.exit(done.stderr)
    log = list(csv.DictReader((folder / "run" / "log.csv").open()))
    last = [line for line in csv.DictReader((folder / "run" / "forces.csv").open()) if line["body"] == "rail"][-1]
    force = [float(last[axis]) for axis in ("fx", "fy", "fz")]
    weight = DENSITY * SIDE ** 2 * 9.81
    carried = (0, -weight * math.sin(SLOPE), weight * math.cos(SLOPE))
    settled, end = (read_ply(file)[0] for file in sorted((folder / "run" / "frames").glob("*.ply")))
    on_rail = [i for i in range((CELLS + 1) ** 2) if i % (CELLS + 1) == CELLS // 2]
    creep = sum(end[i][1] - settled[i][1] for i in on_rail) / len(on_rail) / (END - SETTLED)
    depth = max(float(line["penetration_max_m"]) for line in log)
    unsolved = sum(line["converged"] == "0" for line in log)
    return (f"| {name} | {iterations} | {1e3 * depth:.2g} | {1e3 * creep:.2g} | {math.dist(force, carried) / weight:.1e} | "
            f"{unsolved} of {len(log)} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sim", required=True, help="the program flash-sim")
    parser.add_argument("--out", required=True, type=pathlib.Path)
    options = parser.parse_args()
    print("| contact | iterations, at most | deepest vertex mm | creep mm/s | force off, of the weight | steps unsolved |\n"
          "|---|---|---|---|---|---|")
    for method in METHODS:
        print(row(options.sim, options.out, *method), flush=True)


if __name__ == "__main__":
    main()
