#!/usr/bin/env python3
"""Drape coefficients of a disc of 30 cm between discs of 18 cm (Cusick 1968), over the bending length: flash beside an
independent solver at rest (plate_statics.py), on two meshes, from the same start. Exits with 1 where they differ by more
than three points on the finer mesh."""
import argparse
import json
import math
import pathlib
import subprocess
import sys
import time

import numpy

import plate_statics
import surface

RADIUS, INNER = 0.15, 0.09  # of the disc, and of those that hold it [m]
AREAL_DENSITY, POISSON, MEMBRANE = 0.2, 0.3, 100  # [kg/m^2], -, E t [N/m]
GRAVITY = 9.81
# Bending length [m], D_2 / D_1, folds of the start.
CASES = ((0.02, 1.0, 6), (0.03, 1.0, 6), (0.04, 1.0, 5), (0.05, 1.0, 4), (0.03, 1 / 3, 6), (0.03, 1 / 3, 4))
ALLOWED = 3.0  # points


def disc(cell):
    """Vertices in rings, and triangles counter-clockwise."""
    rings = round(RADIUS / cell)
    rest, first = [(0.0, 0.0)], [0]
    for k in range(1, rings + 1):
        first.append(len(rest))
        rest += [(RADIUS * k / rings * math.cos(math.pi * i / (3 * k)), RADIUS * k / rings * math.sin(math.pi * i / (3 * k)))
                 for i in range(6 * k)]
    triangles = []
    for k in range(1, rings + 1):
        for i in range(6 * k):
            a, b = first[k] + i, first[k] + (i + 1) % (6 * k)
            sector, place = divmod(i, k)
            inner = sector * (k - 1) + place
            count = max(6 * (k - 1), 1)
            triangles.append((first[k - 1] + inner % count, a, b))
            if place < k - 1:
                triangles.append((first[k - 1] + inner % count, b, first[k - 1] + (inner + 1) % count))
    return numpy.array(rest), numpy.array(triangles)


def clamped(rest):
    return numpy.flatnonzero(numpy.hypot(*rest.T) <= INNER + 1e-9)


def start_of(rest, folds):
    """A disc that hangs by 2 cm at its rim, 6 mm more or less in so many folds."""
    angle, way = numpy.arctan2(rest[:, 1], rest[:, 0]), numpy.clip((numpy.hypot(*rest.T) - INNER) / (RADIUS - INNER), 0, 1)
    return numpy.c_[rest, way ** 2 * (0.006 * numpy.cos(folds * angle) - 0.02)]


def coefficient(x, triangles, pixels=1500):
    """Share of the ring that its shadow from above has, in per cent."""
    reach = 1.05 * RADIUS
    size = 2 * reach / pixels
    centres = (numpy.arange(pixels) + 0.5) * size - reach
    shadow = numpy.zeros((pixels, pixels), bool)
    for corners in x[triangles][:, :, :2]:
        low = numpy.clip(numpy.floor((corners.min(0) + reach) / size).astype(int), 0, pixels)
        high = numpy.clip(numpy.ceil((corners.max(0) + reach) / size).astype(int) + 1, 0, pixels)
        at = numpy.meshgrid(centres[low[0]:high[0]], centres[low[1]:high[1]], indexing="ij")
        sides = [(q[0] - p[0]) * (at[1] - p[1]) - (q[1] - p[1]) * (at[0] - p[0]) for p, q in zip(corners, numpy.roll(corners, -1, 0))]
        inside = numpy.all([s >= 0 for s in sides], 0) | numpy.all([s <= 0 for s in sides], 0)
        shadow[low[0]:high[0], low[1]:high[1]] |= inside
    return 100 * (shadow.sum() * size ** 2 - math.pi * INNER ** 2) / (math.pi * (RADIUS ** 2 - INNER ** 2))


def folds_of(x, cell):
    """How often the rim goes in and out: the strongest harmonic of its distance from the axis."""
    rim = x[-6 * round(RADIUS / cell):, :2]
    waves = abs(numpy.fft.rfft(numpy.hypot(*rim.T)))
    return int(numpy.argmax(waves[1:]) + 1)


def write_obj(path, x, triangles):
    lines = ["v %.17g %.17g %.17g" % tuple(p) for p in x] + ["f %d %d %d" % tuple(t + 1) for t in triangles]
    path.write_text("\n".join(lines) + "\n")


def by_flash(options, folder, rest, triangles, rigidity, ratio, start):
    folder.mkdir(parents=True, exist_ok=True)
    write_obj(folder / "disc.obj", numpy.c_[rest, numpy.zeros(len(rest))], triangles)
    write_obj(folder / "start.obj", start, triangles)
    asset = {"schema": "flash-asset/1", "mesh": "disc.obj", "element_type": "TRIANGLE", "mechanical_props": {
        "areal_density": AREAL_DENSITY, "young": MEMBRANE, "poisson": POISSON, "bending_rigidity": rigidity,
        "bending_ratio": ratio, "constitutive": "TRI_COROTATED", "friction": 0.3, "air_drag": 4}}
    scene = {"schema": "flash-scene/1", "timestep": 0.02, "duration": 5, "gravity": [0, 0, -GRAVITY], "keyframes": [5],
             "bending_model": "plate", "solver": {"tolerance": 1e-4}, "objects": {"cloth": {
                 "asset": "asset.json", "start": {"mesh": "start.obj"},
                 "fixed": [{"name": "discs", "vertices": clamped(rest).tolist()}]}}}
    (folder / "asset.json").write_text(json.dumps(asset))
    (folder / "scene.json").write_text(json.dumps(scene))
    done = subprocess.run([options.sim, "run", str(folder / "scene.json"), "-o", str(folder / "out"), "--force", "--quiet"],
                          capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"drape: {done.stderr}")
    return numpy.array(surface.read_ply(max((folder / "out").rglob("*.ply")))[0])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sim", required=True, help="the program flash-sim")
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--cells", default="0.0075,0.005", help="of the meshes, coarse first [m]")
    parser.add_argument("--iterations", type=int, default=6000, help="of the independent solver, at most")
    options = parser.parse_args()
    print("| bending length cm | D_2 / D_1 | start | cell mm | flash: coefficient % | folds | independent: coefficient % | folds | force left | s |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    failed = 0
    cells = [float(cell) for cell in options.cells.split(",")]
    for number, (length, ratio, folds) in enumerate(CASES):
        for cell in cells:
            rest, triangles = disc(cell)
            weight = AREAL_DENSITY * GRAVITY
            rigidity, start = weight * length ** 3, start_of(rest, folds)
            ours = by_flash(options, options.out / f"{number}_{cell:g}", rest, triangles, rigidity, ratio, start)
            begin = time.monotonic()
            sheet = plate_statics.Plate(rest, triangles, MEMBRANE, POISSON, rigidity, weight, clamped(rest), ratio)
            other, left = sheet.settle(start, 2e-4, options.iterations)
            found = coefficient(ours, triangles), coefficient(other, triangles)
            failed += cell == cells[-1] and abs(found[0] - found[1]) > ALLOWED
            print(f"| {100 * length:g} | {ratio:.2g} | {folds} | {1e3 * cell:g} | {found[0]:.1f} | {folds_of(ours, cell)} | {found[1]:.1f} | "
                  f"{folds_of(other, cell)} | {left:.1e} | {time.monotonic() - begin:.0f} |", flush=True)
    print(f"{failed} of {len(CASES)} differ by more than {ALLOWED:g} points on the finer mesh")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
