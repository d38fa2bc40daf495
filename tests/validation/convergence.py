"""How far tolerance, iterations, time step and mesh move a lift, a drape and a stretch."""
import json
import math
import subprocess

from surface import read_ply

SIDE = 0.2  # of the sheet [m]
CELL, STEP, TOLERANCE, ITERATIONS = 0.02, 0.01, 1e-3, 60  # the study's mesh; else the programs' defaults
TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5)
REFERENCE_TOLERANCE = 1e-7
BUDGETS = (1, 2, 4, 8, 60)
STEPS = (0.02, 0.01, 0.005, 0.0025, 0.00125)
CELLS = (0.04, 0.02, 0.01, 0.005)
PATCH = 0.04  # of the grasp, whatever the mesh [m]


def smooth(tau):
    return tau ** 3 * (10 - 15 * tau + 6 * tau ** 2)


def rest(cell):
    count = round(SIDE / cell) + 1
    return [(i * SIDE / (count - 1), j * SIDE / (count - 1)) for j in range(count) for i in range(count)]


def path(seconds, end):
    """Keyframes every 5 ms, whatever the step."""
    return [{"t": t, "translation": [smooth(t / seconds) * x for x in end]}
            for t in (k * 0.005 for k in range(round(seconds / 0.005) + 1))]


def taken(cell, inside):
    return [v for v, (x, y) in enumerate(rest(cell)) if inside(x, y)]


def lift(cell):
    return 0.8, {"obstacles": {"table": {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1], "friction": 0.3}}}, {
        "prescribed": [{"vertices": taken(cell, lambda x, y: min(x, y) > SIDE - PATCH - 1e-9),
                        "keyframes": path(0.8, [-0.06, -0.02, 0.15])}]}


def drape(cell):
    peg = {"shape": "cylinder", "point": [0.09, 0.1, -0.041], "axis": [0, 1, 0], "radius": 0.04, "friction": 0.3}
    return 0.4, {"obstacles": {"peg": peg}}, {}


def stretch(cell):
    return 0.4, {}, {"fixed": [{"vertices": taken(cell, lambda x, y: x < 1e-9)}],
                     "prescribed": [{"vertices": taken(cell, lambda x, y: x > SIDE - 1e-9),
                                     "keyframes": path(0.4, [0.02, 0, 0])}]}


EXPERIMENTS = {"lift": lift, "drape": drape, "stretch": stretch}


class Study:
    def __init__(self, sim, out):
        self.sim, self.out = str(sim), out

    def run(self, experiment, cell=CELL, step=STEP, tolerance=TOLERANCE, iterations=ITERATIONS):
        """The last positions and the program's summary."""
        seconds, world, holds = EXPERIMENTS[experiment](cell)
        folder = self.out / "convergence" / f"{experiment}_{cell:g}_{step:g}_{tolerance:g}_{iterations}"
        folder.mkdir(parents=True, exist_ok=True)
        asset = {"schema": "flash-asset/1", "mesh": f"sheet:{SIDE}x{SIDE}:{cell}:alternating", "element_type": "TRIANGLE",
                 "mechanical_props": {"areal_density": 0.2, "young": 100, "poisson": 0.3, "bending_rigidity": 1e-4,
                                      "constitutive": "TRI_COROTATED", "friction": 0.3}}
        scene = {"schema": "flash-scene/1", "timestep": step, "duration": seconds, "gravity": [0, 0, -9.81],
                 "keyframes": [seconds], "solver": {"tolerance": tolerance, "iterations": iterations},
                 "objects": {"cloth": {"asset": "asset.json", **holds}}, **world}
        text = json.dumps(scene)
        kept = folder / "scene.json"
        if not (kept.exists() and kept.read_text() == text and (folder / "summary.json").exists()):
            (folder / "asset.json").write_text(json.dumps(asset))
            kept.write_text(text)
            done = subprocess.run([self.sim, "run", str(kept), "-o", str(folder / "out"), "--force", "--quiet", "--json",
                                   "--threads", "1"], capture_output=True, text=True)
            if done.returncode not in (0, 3):
                raise SystemExit(f"convergence: {folder.name}: {done.stderr}")
            (folder / "summary.json").write_text(json.dumps(json.loads(done.stdout) | {"stderr": done.stderr}))
        summary = json.loads((folder / "summary.json").read_text())
        last = folder / "out" / "frames" / f"{round(seconds / step):06d}.ply"
        return dict(zip(map(rounded, rest(cell)), read_ply(last)[0])), summary


def rounded(point):
    return tuple(round(x / 1e-6) for x in point)


def change(a, b):
    """Root mean square distance of the vertices that both have [m]."""
    common = a.keys() & b.keys()
    return math.sqrt(sum(math.dist(a[v], b[v]) ** 2 for v in common) / len(common))


def tables(sim, out, table):
    study = Study(sim, out)
    return {"convergence_solver": table(
                ["experiment", "tolerance", "iterations at most", "worst residual", "steps that missed it", "warned",
                 "positions change mm", "iterations per step"],
                [row for name in EXPERIMENTS for row in solver_rows(study, name)]),
            "convergence_resolution": table(
                ["experiment", "halved again and again", *(f"change {k} mm" for k in (1, 2, 3, 4)), "order"],
                [row for name in EXPERIMENTS for row in resolution_rows(study, name)])}


def solver_rows(study, name):
    exact, _ = study.run(name, tolerance=REFERENCE_TOLERANCE, iterations=400)
    for tolerance, iterations in [(t, ITERATIONS) for t in TOLERANCES] + [(TOLERANCE, k) for k in BUDGETS[:-1]]:
        positions, summary = study.run(name, tolerance=tolerance, iterations=iterations)
        yield [name, f"{tolerance:g}", str(iterations), f"{summary['residual_max']:.1e}",
               f"{summary['unconverged_steps']} of {summary['steps']}", "yes" if "did not converge" in summary["stderr"]
               else "no", f"{1000 * change(positions, exact):.2g}",
               f"{summary['iterations'] / summary['steps']:.1f}"]


def resolution_rows(study, name):
    """Each change is that from one value to its half; the order is of the last two."""
    for what, values in (("step", STEPS), ("cell", CELLS)):
        runs = [study.run(name, tolerance=1e-5, iterations=400, **{what: value})[0] for value in values]
        changes = [1000 * change(a, b) for a, b in zip(runs, runs[1:])]
        order = math.log2(changes[-2] / changes[-1])
        yield [name, f"{what}, from {values[0]:g} {'s' if what == 'step' else 'm'}",
               *(f"{x:.2g}" for x in changes), *["-"] * (4 - len(changes)), f"{order:.1f}"]
