#!/usr/bin/env python3
"""How far cells move D of a lift by a corner: of motions as cells are halved, and of searches of one recording on coarser and finer
cells, and with the patch stated otherwise. The tables go into docs/validation/grasp.md."""
import argparse
import concurrent.futures
import json
import math
import pathlib

import numpy

import runs as kept
import synthetic
import tables
from surface import read_ply

CELL, PATCH, SIDE = 0.02, 0.02, 0.3  # of searches, of the grasp, of the towel [m]
FRAMES = (10, 15, 20, 25, 30)  # of 31, ten a second
STEP = 0.05  # of the logarithm of D, to either side
# What a motion is of: one value of each is another in turn.
BASE = {"grasp": "clamp", "young": 100.0, "bending": 1e-4, "side": SIDE}
OTHERS = {"grasp": ("pinch", "point"), "young": (10.0, 1000.0), "bending": (1e-5, 1e-3), "side": (0.2, 0.5, 1.0)}
CASES = [BASE] + [BASE | {name: value} for name, values in OTHERS.items() for value in values]
HALVINGS = {"grasp": 3, "sheet": 2}
PLACES = {"grasp": "at the grasp", "sheet": "of the sheet"}

TRUTH = {"bending": 2e-4, "friction": 0.3}
SEARCH_CELLS = (0.04, 0.028, 0.02, 0.014, 0.01, 0.007)
STATED = (0.017, 0.02, 0.023, 0.026)  # size of the patch [m]
FEW_CELLS = (0.028, 0.02, 0.014)
# Change of the case, cells, and whether the mesh is a file.
SEARCHES = [({}, cell, False) for cell in SEARCH_CELLS] + [({}, cell, True) for cell in FEW_CELLS] + [
    ({name: value}, cell, False) for name, value in (("grasp", "point"), ("grasp", "pinch"), ("young", 10.0), ("young", 1000.0))
    for cell in FEW_CELLS]


def grasp_options(case):
    return {"clamp": ("--grasp-shape", "clamp"), "point": ("--grasp-shape", "point"),
            "pinch": ("--grasp-shape", "pinch", "--hold", f"grasp_depth={PATCH}:measured")}[case["grasp"]]


def cell_of(case):
    """Of a search [m]."""
    return max(CELL, case["side"] / 25)


def mesh_of(case, cell):
    return f"sheet:{case['side']:g}x{case['side']:g}:{cell:g}"


def asset_of(runs, case):
    return synthetic.write_asset(runs.out, f"asset_{case['young']:g}.json", young=case["young"])


def positions(folder, places):
    """Of material points, given by where they lie on the table before the lift, and the sheet's normals there: places x frames x 3."""
    rest, faces = read_ply(folder / "000_mesh.ply")
    corners = numpy.array(rest)[numpy.array(faces)][:, :, :2]
    origin, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    frames = [numpy.array(read_ply(folder / f"{frame:03d}_mesh.ply")[0]) for frame in FRAMES]
    found, normals = [], []
    for place in places:
        d = place - origin
        b = (d[:, 0] * v[:, 1] - d[:, 1] * v[:, 0]) / area
        c = (u[:, 0] * d[:, 1] - u[:, 1] * d[:, 0]) / area
        least = numpy.minimum(numpy.minimum(b, c), 1 - b - c)
        face = int(least.argmax())
        weights = numpy.array([1 - b[face] - c[face], b[face], c[face]])
        there = [frame[list(faces[face])] for frame in frames]
        found.append([weights @ corners for corners in there])
        across = numpy.array([numpy.cross(corners[1] - corners[0], corners[2] - corners[0]) for corners in there])
        normals.append(across / numpy.linalg.norm(across, axis=1, keepdims=True))
    return numpy.array(found), numpy.array(normals)


def places_on(folder, count=16):
    """Even over the sheet as it lies on the table."""
    rest = numpy.array(read_ply(folder / "000_mesh.ply")[0])[:, :2]
    corners = [rest[(rest @ direction).argmin()] for direction in numpy.array([[1, 0], [0, 1], [-1, 0]])]
    # A square that lies on its corner or its side: three of its corners in turn.
    steps = (numpy.arange(count) + 0.5) / count
    a, b, c = corners
    return [b + s * (a - b) + t * (c - b) for s in steps for t in steps]


def motion(runs, recording, case, cell, grasp_cell, bending):
    name = "_".join(str(x) for x in ("motion", case["grasp"], case["young"], case["side"], bending, cell, grasp_cell))
    settings = {"bending": bending, "friction": 0.3, "areal_density": 0.2}
    runs.replay(name, recording, settings, "--asset", asset_of(runs, case), "--mesh", mesh_of(case, cell), "--grasp-cell", repr(grasp_cell),
                "--grasp-within", repr(PATCH), *grasp_options(case), "--tolerance", "1e-5",
                frames=",".join(map(str, (0, *FRAMES))))
    return runs.out / name


def recording_of(runs, case):
    return runs.synth(f"path_{case['side']:g}", asset_of(runs, BASE), "--mesh", mesh_of(case, case["side"] / 10), "--grasp-within", repr(PATCH),
                      "--rate", "10", "--noise", "0.001", "--seed", "1")


def convergence_row(runs, case):
    """What each halving changes, in mm along the sheet's normal, as a camera sees it, and as a share of D: of the cells at the grasp,
    and of the others."""
    recording = recording_of(runs, case)
    cell = cell_of(case)
    near = min(cell, PATCH) / 5  # as flash has it by itself
    bending = case["bending"]
    own = motion(runs, recording, case, cell, near, bending)
    places = places_on(own)
    start, normals = positions(own, places)
    ends = [positions(motion(runs, recording, case, cell, near, bending * math.exp(sign * STEP)), places)[0] for sign in (-1, 1)]
    slope = ((ends[1] - ends[0]) * normals).sum(-1) / (2 * STEP)
    cells = []
    for which, sizes in (("grasp", lambda k: (cell, near / 2 ** k)), ("sheet", lambda k: (cell / 2 ** k, near))):
        before = start
        for k in range(1, HALVINGS[which] + 1):
            after = positions(motion(runs, recording, case, *sizes(k), bending), places)[0]
            change = ((after - before) * normals).sum(-1)
            shift = -float((slope * change).sum() / (slope * slope).sum())  # by which D answers for it
            cells += [f"{1000 * math.sqrt((change ** 2).mean()):.2g}", f"{100 * shift:+.1f} %"]
            before = after
    return [case["grasp"], f"{case['young']:g}", tables.number(bending), f"{case['side']:g}", *cells]


def truth_of(runs, case):
    """One recording on cells that nobody searches with."""
    name = "truth_" + "_".join(f"{key}_{value}" for key, value in case.items())
    return runs.synth(name, asset_of(runs, case), "--mesh", mesh_of(case, 0.005), "--grasp-cell", "0.00025", "--grasp-shape", case["grasp"],
                      "--grasp-within", repr(PATCH), "--time-step", "0.0025", "--rate", "10", "--noise", "0.001", "--seed", "7",
                      *synthetic.settings(TRUTH))


def write_even_triangles(path, side, cell):
    """Rows of equilateral triangles, as nearly as they divide the side."""
    across, rows = round(side / cell), round(side / (cell * math.sqrt(0.75)))
    places, lines = [], []
    for j in range(rows + 1):
        inner = range(1, across) if j % 2 == 0 else (i + 0.5 for i in range(across))
        lines.append([len(places) + k for k in range(across + (1 if j % 2 == 0 else 2))])
        places += [(x * side / across, j * side / rows) for x in (0, *inner, across)]
    faces = []
    for below, above in zip(lines, lines[1:]):
        i = k = 0
        while i + 1 < len(below) or k + 1 < len(above):
            ahead = [places[row[n + 1]][0] if n + 1 < len(row) else math.inf for row, n in ((below, i), (above, k))]
            if ahead[0] <= ahead[1]:
                faces.append((below[i], below[i + 1], above[k]))
                i += 1
            else:
                faces.append((below[i], above[k + 1], above[k]))
                k += 1
    path.write_text("".join(f"v {x!r} {y!r} 0\n" for x, y in places) + "".join("f {} {} {}\n".format(*(v + 1 for v in face)) for face in faces))
    return str(path)


def search(runs, case, cell, stated=PATCH, from_file=False):
    mesh = write_even_triangles(runs.out / f"even_{cell:g}.obj", case["side"], cell) if from_file else mesh_of(case, cell)
    name = "_".join(["search", *(f"{key}_{value}" for key, value in case.items()), "file" if from_file else "made", f"{cell:g}", f"{stated:g}"])
    return runs.grid(name, [truth_of(runs, case)], "--asset", asset_of(runs, case), "--mesh", mesh, "--grasp-within", repr(stated),
                     *grasp_options(case), "--bending", "5e-5:1e-3:7:log", "--friction", "0.15:0.6:4", "--hold", "areal_density=0.2:measured",
                     "--hold", f"young={case['young']:g}:measured", "--no-plan", "--rollouts", str(runs.out / "motions"))


def finding_cells(summary):
    cells = []
    for name, truth in TRUTH.items():
        finding = summary["parameters"][name]
        low, high = finding["interval95"]
        share = [100 * (x / truth - 1) for x in (finding["estimate"], low, high)]
        held = {True: "", False: ", **misses**", None: ", no claim"}[synthetic.holds(finding, truth)]
        cells.append(f"{share[0]:+.1f} % ({share[1]:+.1f} to {share[2]:+.1f}){held}")
    fits = all(recording["model_fits"] for recording in summary["recordings"])
    return [*cells, "fits" if fits else "does not fit"]


def search_row(runs, change, cell, from_file):
    case = BASE | {"bending": TRUTH["bending"]} | change
    summary = search(runs, case, cell, from_file=from_file)
    return [case["grasp"], f"{case['young']:g}", f"{1000 * cell:g}" + (", a file" if from_file else ""), *finding_cells(summary), f"{summary['wall_seconds']:.0f}"]


def stated_row(runs, stated):
    summary = search(runs, BASE | {"bending": TRUTH["bending"]}, CELL, stated)
    return [f"{1000 * stated:g}", *finding_cells(summary)]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sysid", required=True, help="the program flash-sysid")
    parser.add_argument("--out", required=True, type=pathlib.Path, help="folder of the runs; the same command again goes on where it stopped")
    parser.add_argument("--documents", type=pathlib.Path, help="folder of the chapters, where the tables go; without it, they are printed alone")
    parser.add_argument("--only", choices=("motions", "searches", "sizes"), help="one of the tables")
    parser.add_argument("--jobs", type=int, default=1, help="rows at a time")
    parser.add_argument("--threads", type=int, help="of each search; without it, as many as there are processors")
    parser.add_argument("--minutes", type=float, help="after which no row is begun")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    runs = kept.Runs(options.sysid, options.out, options.threads)
    parts = {
        "motions": ("grasp_motions", convergence_row, [(case,) for case in CASES],
                    ["grasp", "E t N/m", "D N m", "side m", *(f"{PLACES[what]}, {k}: mm | D" for what, count in HALVINGS.items()
                                                              for k in range(1, count + 1))]),
        "searches": ("grasp_searches", search_row, SEARCHES, ["grasp", "E t N/m", "cells mm", "D over the truth", "friction, likewise", "says", "s"]),
        "sizes": ("grasp_sizes", stated_row, [(size,) for size in STATED], ["stated mm", "D over the truth", "friction, likewise", "says"])}
    found = {}
    for part, (name, row, items, header) in parts.items():
        if options.only not in (None, part):
            continue
        if part == "searches":  # truths are shared
            with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
                list(pool.map(lambda case: truth_of(runs, case), [BASE | {"bending": TRUTH["bending"]} | dict(change) for change in
                                                                  {tuple(change.items()) for change, _, _ in SEARCHES}]))
        rows = dict(kept.each_in_time(lambda k: row(runs, *items[k]), range(len(items)), options.jobs, options.minutes))
        header = [word for text in header for word in text.split(" | ")]
        found[name] = tables.table(header, [rows[k] for k in sorted(rows)])
        print(found[name], flush=True)
    if options.documents:
        tables.replace_tables(options.documents, found)


if __name__ == "__main__":
    main()
