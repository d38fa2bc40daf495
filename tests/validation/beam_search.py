"""Young's modulus of the silicone beam by flash-sysid: from its sag, bare and with a weight, and from its ring-down."""
import csv
import json

import numpy

from beam import DENSITY, LENGTH, LOADS, MARKERS, POISSON, REPEATS, SETTLED, SIDE, Track, rigid

PLACED = {marker: numpy.array(place) + (LENGTH, 0, 0) for marker, place in MARKERS.items()}  # x from the clamp on
ON_SUPPORT = [marker for marker in MARKERS if marker.startswith("Base")]
CELLS = (2, 3, 4)  # through the thickness, of the mesh that is searched; the answer has half the cell too
GRID = ("--young", "1.8e5:3.6e5:5:log", "--poisson", "0.45:0.499:3", "--hold", f"density={DENSITY}:measured")
REST = ("--time-step", "1", "--tolerance", "1e-6", "--from", "1")  # long steps: at rest after a few


def write_asset(out):
    path = out / "beam.json"
    path.write_text(json.dumps({"schema": "flash-asset/1", "mesh": mesh(CELLS[1]), "element_type": "TETRAHEDRON",
                                "element_order": 2,
                                "mechanical_props": {"density": DENSITY, "young": 250e3, "poisson": POISSON,
                                                     "constitutive": "TET_NEOHOOKEAN"}}))
    return path


def mesh(cells):
    return f"box:{LENGTH}x{SIDE}x{SIDE}:{SIDE / cells}"


def write_recording(path, folder, weight, samples):
    """The folder of a recording; `samples`: of a track the times and positions by marker that are kept."""
    track = Track(path)
    rows = numpy.genfromtxt(path, delimiter=",", skip_header=1)
    names = path.read_text().splitlines()[0].split(",")
    seen = {m: rows[:, [names.index(f"{m}_{axis}_m") for axis in "xyz"]] for m in MARKERS}
    start = {m: seen[m][:track.release - 2].mean(axis=0) for m in MARKERS}
    turn, _ = rigid(numpy.array(list(PLACED.values())), numpy.array([start[m] for m in MARKERS]))
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / "tracks.csv", "w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["t", "marker", "x", "y", "z"])
        for time, where in [(rows[track.release, 0], start), *samples(rows[:, 0], seen, track.release)]:
            for m in MARKERS:
                table.writerow([f"{time:.6g}", m, *(f"{x:.8g}" for x in where[m])])
    with open(folder / "placed.csv", "w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["marker", "x", "y", "z"])
        for m, place in PLACED.items():
            table.writerow([m, *(f"{x:.8g}" for x in place)])
    recording = {"schema": "flash-recording/1", "name": folder.name, "kind": "cantilever",
                 "gravity": list(map(float, turn @ (0, 0, -9.81))), "object": {"mesh": mesh(CELLS[1])},
                 "supports": [{"name": "clamp", "select": {"box": {"max": [0, None, None]}}}],
                 "markers": {"tracks": "tracks.csv", "placed": "placed.csv", "on_support": ON_SUPPORT}}
    if weight:
        recording["loads"] = [{"attached_mass": weight, "select": {"box": {"min": [LENGTH, None, SIDE]}}}]
    (folder / "recording.json").write_text(json.dumps(recording, indent=1))
    return folder


def at_rest(times, seen, release):
    """The mean of the last frames."""
    return [(times[-1], {m: seen[m][-SETTLED:].mean(axis=0) for m in seen})]


def fit(runs, name, recordings, asset, cells, poisson=None):
    grid = GRID if poisson is None else (*GRID[:2], "--hold", f"poisson={poisson}", *GRID[4:])
    return runs.grid(f"beam_search/{name}", recordings, "--asset", str(asset), "--mesh", mesh(cells), *grid, *REST)


def tables(runs, data, table):
    out = runs.out / "beam_search"
    out.mkdir(parents=True, exist_ok=True)
    asset = write_asset(out)
    recordings = {(load, r): write_recording(data / f"beam_{load}_V2_{r}.csv", out / f"{load}_{r}", weight, at_rest)
                  for load, weight in LOADS.items() for r in REPEATS}
    kilo = lambda x: f"{x / 1e3:.0f}"

    def row(load, used, cells, summary):
        found = {parameter["name"]: parameter for parameter in named(summary)}
        young, poisson = found["young"], found.get("poisson")
        low, high = young["interval95"]
        return [load, used, str(cells), kilo(young["estimate"]), f"{kilo(low)} to {kilo(high)}",
                f"held at {POISSON}" if poisson is None else VERDICTS[poisson["identifiable"]]]

    rows = [row(load, "a and b", CELLS[0], fit(runs, f"{load}_both", [recordings[load, r] for r in REPEATS], asset,
                                               CELLS[0])) for load in LOADS]
    rows += [row(load, "b", cells, fit(runs, f"{load}_{cells}", [recordings[load, "b"]], asset, cells, POISSON))
             for load in LOADS for cells in CELLS]
    return {"beam_search": table(["load", "repeats", "cells searched", "E kPa", "95 %", "Poisson's ratio"], rows)}


def named(summary):
    return [{"name": name, **finding} for name, finding in summary["parameters"].items()]


VERDICTS = {"yes": "told", "no": "not told", "lower_bound": "a lower bound", "upper_bound": "an upper bound"}
