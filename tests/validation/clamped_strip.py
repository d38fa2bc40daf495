#!/usr/bin/env python3
"""Says by how much a strip that a clamp holds out against gravity sags more than the beam of Euler and Bernoulli, with places
held alone and with slopes, over its cells. Writes the table into docs/validation/."""
import argparse
import json
import pathlib
import subprocess

import tables
from surface import read_ply

LENGTH, DENSITY, GRAVITY = 0.1, 0.2, 9.81
WEIGHT = 0.1  # rho_A g L^3 / D: the tip sags by an eightieth of the length
CELLS = (10, 20, 40, 80)
# Bending model, pattern of the mesh: the one on which the rigidity of the model is what it is told.
MODELS = {"plate": "alternating", "hinge": "alternating_by_row", "isometric": "alternating_by_row"}


def too_soft(sim, folder, model, cells, slopes):
    """The sag of the tip over rho_A g L^4 / (8 D), less 1. The strip is two cells wide, and one more in length is held."""
    folder.mkdir(parents=True, exist_ok=True)
    cell, columns, rigidity = LENGTH / cells, cells + 2, DENSITY * GRAVITY * LENGTH ** 3 / WEIGHT
    asset = {"schema": "flash-asset/1", "mesh": f"sheet:{LENGTH + cell}x{2 * cell}:{cell}:{MODELS[model]}", "element_type": "TRIANGLE",
             "mechanical_props": {"constitutive": "TRI_COROTATED", "areal_density": DENSITY, "poisson": 0.0,
                                  "young": 2e4 * DENSITY * GRAVITY * LENGTH, "bending_model": model, "bending_rigidity": rigidity}}
    held = {"vertices": [row * columns + column for row in range(3) for column in range(2)], **({"slopes": True} if slopes else {})}
    scene = {"schema": "flash-scene/1", "gravity": [0, 0, -GRAVITY], "timestep": 1.0, "steps": 60, "quasistatic": {"motion": 1e-9},
             "solver": {"tolerance": 1e-5}, "objects": {"strip": {"asset": "asset.json", "fixed": [held]}}}
    (folder / "asset.json").write_text(json.dumps(asset))
    (folder / "scene.json").write_text(json.dumps(scene))
    subprocess.run([sim, "run", str(folder / "scene.json"), "-o", str(folder / "out"), "--force", "--quiet"], check=True)
    vertices, _ = read_ply(sorted((folder / "out" / "frames").glob("*.ply"))[-1])
    tip = -sum(vertices[row * columns + columns - 1][2] for row in range(3)) / 3
    return tip / (DENSITY * GRAVITY * LENGTH ** 4 / (8 * rigidity)) - 1


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sim", required=True, help="the program flash-sim")
    parser.add_argument("--out", required=True, type=pathlib.Path, help="folder of the runs")
    parser.add_argument("--documents", type=pathlib.Path, help="folder of the chapters, where the table goes")
    options = parser.parse_args()
    rows = []
    for model, pattern in MODELS.items():
        for slopes in (False, True):
            found = [too_soft(options.sim, options.out / f"{model}_{cells}_{slopes:d}", model, cells, slopes) for cells in CELLS]
            rows.append([model, pattern, "yes" if slopes else "no", *(f"{100 * share:.2f}" for share in found)])
    table = tables.table(["bending model", "mesh", "slopes", *(f"{cells} cells %" for cells in CELLS)], rows)
    print(table, end="")
    if options.documents:
        tables.replace_tables(options.documents, {"clamped_strip": table})


if __name__ == "__main__":
    main()
