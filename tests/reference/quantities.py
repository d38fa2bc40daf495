"""What a reference scene expects, from the frames, the log and the forces that flash-sim wrote."""
import csv
import math
import pathlib
import sys

import scene_files

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "validation"))
from surface import read_ply  # noqa: E402


class Output:
    """A folder written by flash-sim run."""

    def __init__(self, folder):
        self.folder = folder
        with open(folder / "log.csv", newline="") as file:
            self.log = [{key: float(text) for key, text in row.items()} for row in csv.DictReader(file)]
        self.forces = {}
        with open(folder / "forces.csv", newline="") as file:
            for row in csv.DictReader(file):
                self.forces[row["body"]] = tuple(float(row[key]) for key in ("fx", "fy", "fz"))  # the last step's

    def frame(self, step):
        return read_ply(self.folder / "frames" / f"{step:06d}.ply")[0]

    @property
    def steps(self):
        return round(self.log[-1]["step"])

    @property
    def last(self):
        return self.frame(self.steps)

    def force_on(self, vertices):
        return [sum(components) for components in zip(*(self.forces[f"vertex {v}"] for v in vertices))]


def of(scene, rest, output, reference):
    """{quantity: number, list or list of rows}; more than the scene asks for. `reference`: positions, or {t: rms}."""
    if scene["kind"] == "unit":
        energy = output.log[-1]["elastic_J" if "material" in scene else "bending_J"]
        return {"energy": energy, "force": [[-f for f in output.forces[f"vertex {v}"]] for v in range(len(rest))]}
    if "frames" in scene:
        return {"vertex rms to reference positions at each frame [m]":
                max(rms(output.frame(round(float(t) / scene["dt"])), points) for t, points in reference.items())}
    if scene["kind"] == "equilibrium":
        drift = max(math.dist(a, b) for step in range(output.steps + 1)
                    for a, b in zip(output.frame(step), reference))
        # Energies and forces at the reference positions: one step on.
        return {"max drift after 1 s [m]": drift, "gripper force [N]": list(output.forces["gripper"]),
                "potential of membrane [J]": output.log[-1]["membrane_J"],
                "potential of bending [J]": output.log[-1]["bending_J"]}
    if scene["kind"] == "dynamic":
        return of_motion(scene, rest, output)
    if scene_files.is_solid(scene):
        if "fixed" in scene:
            return {"mean tip drop m": tip_drop(rest, output)}
        return of_bar(scene, rest, output)
    if "L_eff" in scene:
        return of_cantilever(scene, rest, output)
    if scene["name"].startswith("hang_strip"):
        down = [a[2] - b[2] for a, b in zip(rest, output.last)]
        return {"tip elongation m": max(down), "downward displacement m": down,
                "support force N": output.force_on(scene["fixed"]["vertices"])[2]}
    return of_patch(scene, rest, output, reference)


def rms(a, b):
    return math.sqrt(sum(math.dist(p, q) ** 2 for p, q in zip(a, b)) / len(a))


def of_motion(scene, rest, output):
    last, before = output.last, output.frame(output.steps - 1)
    velocity = [[(a - b) / scene["dt"] for a, b in zip(p, q)] for p, q in zip(last, before)]
    moved = {axis: [p[k] - q[k] for p, q in zip(last, rest)] for k, axis in enumerate("xyz")}
    along = moved["x"]
    height = [p[2] for p in last]
    quantities = {"z (implicit Euler)": height, "z (continuum) ": height, "x displacement after 1 s": along,
                  "distance (implicit Euler)": along, "distance (continuum)": along,
                  "y,z displacement": max(abs(p[k] - q[k]) for p, q in zip(last, rest) for k in (1, 2)),
                  "final speed": max(math.hypot(*v) for v in velocity), "velocity after one step": velocity}
    quantities |= {f"{axis} displacement after 1 s": values for axis, values in moved.items()}
    if "plane" in output.forces:
        quantities["normal force sum N"] = output.forces["plane"][2]
    return quantities


def of_bar(scene, rest, output):
    (_, width, height), pull = map(max, zip(*rest)), output.forces["right"][0]
    strain = scene["stretch"] - 1
    return {"positions": output.last, "pull force N": pull, "E recovered": pull / (width * height * strain),
            "nu recovered": (1 - max(y for _, y, _ in output.last) / width) / strain}


def tip_drop(rest, output):
    end = max(x for x, _, _ in rest)
    drops = [q[2] - p[2] for p, q in zip(output.last, rest) if q[0] == end]
    return sum(drops) / len(drops)


def of_cantilever(scene, rest, output):
    end = max(x for x, _, _ in rest)
    tip = [p for p, q in zip(output.last, rest) if q[0] == end]
    drop, along = (sum(p[k] for p in tip) / len(tip) for k in (2, 0))
    length = scene["L_eff"]
    weight = scene["material"]["areal_density"] * -scene["gravity"][2]
    return {"tip drop / L_eff": -drop / length, "tip x / L_eff": (along + length - end) / length,
            "tip drop / (w L_eff^4/8D)": -drop / (weight * length ** 4 / (8 * scene["bending"]["D"]))}


def of_patch(scene, rest, output, reference):
    last = output.last
    right, top = max(x for x, _, _ in rest), max(y for _, y, _ in rest)
    width = max(y for _, y, _ in last) - min(y for _, y, _ in last)
    quantities = {"max deviation from affine m": max(math.dist(a, b) for a, b in zip(last, reference)),
                  "lateral stretch": width / top, "stored energy J": output.log[-1]["membrane_J"]}
    thickness = scene["material"]["thickness"]
    if "rollers" in scene:
        pull, strain = output.forces["right"][0], scene["stretch"] - 1
        return quantities | {"pull force N": pull, "E recovered": pull / (top * thickness * strain),
                             "nu recovered": (1 - width / top) / strain}
    edge = [v for v, p in enumerate(rest) if p[0] == right]
    inner = [v for v in edge if 0 < rest[v][1] < top]
    force = [list(output.forces[f"vertex {v}"]) for v in inner]
    quantities |= {"right edge force N": output.force_on(edge)[:2], "right edge inner vertex force N":
                   [f[:2] for f in force],
                   "top edge force y N": output.force_on([v for v, p in enumerate(rest) if p[1] == top])[1]}
    if scene["name"].startswith("shear"):
        # F_21 = gamma/2; an inner vertex of the edge carries one of the four cells.
        gamma = 2 * (last[edge[0]][1] - rest[edge[0]][1]) / right
        quantities["shear modulus P12/gamma Pa"] = force[0][1] / (top / 4 * thickness) / gamma
    return quantities
