"""Young's modulus of a real silicone beam from its sag, over load, repeat, mesh and Poisson's ratio; and how it rings."""
import json
import math
import subprocess

import numpy

from surface import read_ply

LENGTH, SIDE, DENSITY = 0.1, 0.03, 1070  # of the data's authors [m, kg/m^3]
LOADS = {"gravity": 0.0, "load52": 0.052}  # on the edge of greatest x and z [kg]
REPEATS = ("a", "b")
# Where the authors place the markers on the model [m].
MARKERS = {"Tip-1": (0, 0.015, 0.036), "Tip-2": (0, -0.006, 0.024), "Tip-3": (0, 0.036, 0.006),
           "Base-1": (-0.094, -0.01, -0.001), "Base-2": (-0.094, 0.04, 0.0275), "Base-3": (-0.094, 0.04, 0)}
TIPS = ("Tip-1", "Tip-2", "Tip-3")
MOVES = 2e-4  # from one frame to the next, where the beam has been let go [m]
SETTLED = 50  # frames at the end
POISSON, FINE, START = 0.499, (2, 4), 250e3  # nu, (order, cells through the thickness), E [Pa]
MESHES = ((1, 2), (1, 4), (1, 8), (2, 1), (2, 2), (2, 4), (2, 6))
STEP, SECONDS, PERIODS = 0.002, 1.0, 3  # of the ring-down


def rigid(points, places):
    """The rotation R and the way t with R x + t next to the places (Kabsch 1976)."""
    centre, middle = points.mean(axis=0), places.mean(axis=0)
    u, _, v = numpy.linalg.svd((points - centre).T @ (places - middle))
    turn = v.T @ numpy.diag([1, 1, numpy.linalg.det(v.T @ u.T)]) @ u.T
    return turn, middle - turn @ centre


def centre_of_swing(heights):
    """About what a decaying oscillation swings, from its first three turns: those of a geometric row (Aitken 1926)."""
    turns = [h for before, h, after in zip(heights, heights[1:], heights[2:]) if (h - before) * (after - h) < 0][:3]
    return (turns[0] * turns[2] - turns[1] ** 2) / (turns[0] + turns[2] - 2 * turns[1])


class Track:
    """Markers of a recording in the model's axes, x along the beam and z up: those of the recording are turned by some
    degrees against it. `misfit`: of the markers that are held, against where the authors place them. `sag` is at the end,
    `swing` that about which the markers swing at first [m]."""

    def __init__(self, path):
        rows = numpy.genfromtxt(path, delimiter=",", skip_header=1)
        names = path.read_text().splitlines()[0].split(",")
        self.times = rows[:, 0]
        seen = {m: rows[:, [names.index(f"{m}_{axis}_m") for axis in "xyz"]] for m in MARKERS}
        speed = numpy.abs(numpy.diff(seen["Tip-1"][:, 0]))
        self.release = int(numpy.argmax(speed > MOVES))
        held = numpy.array([seen[m][:self.release - 2].mean(axis=0) for m in MARKERS])
        places = numpy.array(list(MARKERS.values()))
        turn, way = rigid(held, places)
        self.misfit = math.sqrt(((held @ turn.T + way - places) ** 2).sum(axis=1).mean())
        self.tilt = math.degrees(math.acos(min(1.0, turn[2, 0])))
        turned = {m: seen[m] @ turn.T + way for m in TIPS}
        start = {m: turned[m][:self.release - 2].mean(axis=0) for m in TIPS}
        self.places = start
        self.sag = {m: turned[m][-SETTLED:].mean(axis=0) - start[m] for m in TIPS}
        down = {m: turned[m][self.release:, 2] - start[m][2] for m in TIPS}
        self.swing = {m: numpy.array([0, 0, centre_of_swing(down[m])]) for m in TIPS}
        self.tip = turned["Tip-1"][self.release:, 2] - turned["Tip-1"][-SETTLED:, 2].mean()


class Beam:
    """Runs of flash-sim, kept in `out`."""

    def __init__(self, sim, out):
        self.sim, self.out = str(sim), out / "beam"

    def run(self, young, weight=0.0, order=FINE[0], cells=FINE[1], poisson=POISSON, length=LENGTH, side=SIDE,
            density=DENSITY, tilt=0.0, rings=False):
        """The folder of the frames."""
        shape = (max(1, round(length / (side / cells))), cells, cells)
        vertex = lambda i, j, k: i + (shape[0] + 1) * (j + (cells + 1) * k)
        asset = {"schema": "flash-asset/1", "mesh": f"box:{length}x{side}x{side}:{side / cells}",
                 "element_type": "TETRAHEDRON", "element_order": order,
                 "transformation": {"trans": [-length, 0, 0], "rotation": [0, 0, 0]},
                 "mechanical_props": {"density": density, "young": young, "poisson": poisson,
                                      "constitutive": "TET_NEOHOOKEAN"}}
        held = [vertex(0, j, k) for k in range(cells + 1) for j in range(cells + 1)]
        share = lambda j: weight / cells * (0.5 if j in (0, cells) else 1.0)
        loads = [{"vertices": [vertex(shape[0], j, cells)], "attached_mass": share(j)} for j in range(cells + 1)]
        time = {"timestep": STEP, "duration": SECONDS} if rings else \
            {"timestep": 1.0, "steps": 60, "quasistatic": {"motion": 1e-8}}
        gravity = [9.81 * math.sin(math.radians(tilt)), 0, -9.81 * math.cos(math.radians(tilt))]
        scene = {"schema": "flash-scene/1", "gravity": gravity, "solver": {"tolerance": 1e-6},
                 "objects": {"beam": {"asset": "asset.json", "fixed": [{"vertices": held}],
                                      **({"loads": loads} if weight else {})}}, **time}
        text = json.dumps(asset) + json.dumps(scene)
        folder = self.out / f"{young:.6g}_{weight:g}_{order}_{cells}_{poisson:g}_{length:g}_{side:g}_{density:g}_{tilt:g}_{rings:d}"
        if not ((folder / "done").exists() and (folder / "done").read_text() == text):
            folder.mkdir(parents=True, exist_ok=True)
            (folder / "asset.json").write_text(json.dumps(asset))
            (folder / "scene.json").write_text(json.dumps(scene))
            done = subprocess.run([self.sim, "run", str(folder / "scene.json"), "-o", str(folder / "out"), "--force",
                                   "--quiet", "--threads", "1"], capture_output=True, text=True)
            if done.returncode != 0:
                raise SystemExit(f"beam: {folder.name}: {done.stderr}")
            (folder / "done").write_text(text)
        return folder / "out" / "frames"

    def moves(self, frames, places):
        """How far places near the surface have gone in the last frame, by the affine motion of what is near [m]."""
        files = sorted(frames.glob("*.ply"))
        rest, last = (numpy.array(read_ply(file)[0]) for file in (files[0], files[-1]))
        low, high = rest.min(axis=0), rest.max(axis=0)
        result = []
        for place in places:
            nearest = numpy.clip(place, low, high)
            order = numpy.argsort(numpy.linalg.norm(rest - nearest, axis=1))
            near = order[:max(12, int((numpy.linalg.norm(rest - nearest, axis=1) < 0.012).sum()))]
            design = numpy.column_stack([numpy.ones(len(near)), rest[near] - place])
            result.append(numpy.linalg.lstsq(design, last[near] - rest[near], rcond=None)[0][0])
        return numpy.array(result)

    def modulus(self, track, weight, sag=None, **settings):
        """E with the sag of the markers [Pa], that at the end unless another is given, and what is left of their motion [m]."""
        seen = numpy.array([(sag or track.sag)[m] for m in TIPS])
        young = START
        for _ in range(12):
            found = self.moves(self.run(young, weight, **settings), [track.places[m] for m in TIPS])
            factor = float(found[:, 2] @ seen[:, 2] / (seen[:, 2] @ seen[:, 2]))
            young *= factor
            if abs(factor - 1) < 1e-4:
                break
        return young, seen - found


def crossings(times, heights):
    """Periods between passages downwards through zero [s]."""
    at = [t - (t2 - t) * h / (h2 - h) for t, t2, h, h2 in zip(times, times[1:], heights, heights[1:]) if h > 0 >= h2]
    return numpy.diff(at)[:PERIODS]


def ring(beam, young, weight):
    """Frequency of the beam that is let go [Hz]."""
    files = sorted(beam.run(young, weight, rings=True).glob("*.ply"))
    rest = numpy.array(read_ply(files[0])[0])
    end = numpy.argmax(rest @ (1, 0.1, 0.1))
    still = numpy.array(read_ply(sorted(beam.run(young, weight).glob("*.ply"))[-1])[0])[end][2]
    heights = [read_ply(file)[0][end][2] - still for file in files]
    return 1 / crossings([k * STEP for k in range(len(files))], heights).mean()


def kilo(pascals):
    return f"{pascals / 1e3:.1f}"


def mm(metres):
    return f"{1e3 * metres:.2f}"


def rings(beam, tracks, best, table):
    """Frequencies seen, and predicted with the E of either sag; `best`: that of the sag at the end."""
    rows = []
    for (load, repeat), track in tracks.items():
        seen = 1 / crossings(track.times[track.release:] - track.times[track.release], track.tip).mean()
        swung, _ = beam.modulus(track, LOADS[load], sag=track.swing)
        row = [load, repeat, f"{seen:.2f}"]
        for young, sag in ((best[load, repeat], track.sag), (swung, track.swing)):
            found = ring(beam, young, LOADS[load])
            row += [mm(-numpy.mean([sag[m][2] for m in TIPS])), kilo(young), f"{found:.2f}", f"{100 * (found / seen - 1):+.1f}"]
        rows.append(row)
    return table(["load", "repeat", "measured Hz", "sag at the end mm", "E kPa", "predicted Hz", "off by %",
                  "sag of the swing mm", "E kPa", "predicted Hz", "off by %"], rows)


def tables(sim, data, out, table):
    beam = Beam(sim, out)
    tracks = {(load, r): Track(data / f"beam_{load}_V2_{r}.csv") for load in LOADS for r in REPEATS}

    rows, best = [], {}
    for (load, repeat), track in tracks.items():
        young, rest = beam.modulus(track, LOADS[load])
        best[load, repeat] = young
        sag = numpy.mean([track.sag[m][2] for m in TIPS])
        rows.append([load, repeat, mm(-sag), kilo(young), mm(math.sqrt((rest[:, 2] ** 2).mean())),
                     mm(math.sqrt((rest[:, 0] ** 2).mean()))])

    track = tracks["gravity", "b"]
    meshes = [[("linear", "quadratic")[order - 1], str(cells),
               *(kilo(beam.modulus(tracks[load, "b"], LOADS[load], order=order, cells=cells)[0]) for load in LOADS)]
              for order, cells in MESHES]

    changes = {"Poisson's ratio 0.45 for 0.499": {"poisson": 0.45}, "Poisson's ratio 0.49 for 0.499": {"poisson": 0.49},
               "half a millimetre longer": {"length": LENGTH + 5e-4}, "thicker and wider by 0.2 mm": {"side": SIDE + 2e-4},
               "1 % heavier": {"density": 1.01 * DENSITY}, "a finer mesh, 6 cells": {"cells": 6},
               "tip down by the angle between the axes": {"tilt": track.tilt}}
    effects = [[what, *(f"{100 * (beam.modulus(tracks[load, 'b'], LOADS[load], **change)[0] / best[load, 'b'] - 1):+.1f}"
                        for load in LOADS)] for what, change in changes.items()]

    return {"beam_modulus": table(["load", "repeat", "sag of the markers mm", "E kPa", "left of the sag mm",
                                   "left along the beam mm"], rows),
            "beam_meshes": table(["elements", "cells through the thickness", "E by gravity kPa", "E by 52 g kPa"], meshes),
            "beam_changes": table(["what changes", "E by gravity %", "E by 52 g %"], effects),
            "beam_ring": rings(beam, tracks, best, table)}
