#!/usr/bin/env python3
"""Whether the stated intervals hold the truth: cloth of cells of 6.25 mm (of a pull, 25, of a towel, 20) searched in recordings
of one of a quarter of the cell or less and a quarter of the step, with unknown registration and clock. A second half has an error
that the model does not know of."""
import argparse
import dataclasses
import json
import math
import pathlib
import random
import sys
import time

import numpy

import runs as kept
import synthetic

BOUNDS = {"offset_m": [0.01, 0.01, 0.01], "yaw_rad": 0.02, "time_s": 0.03}


@dataclasses.dataclass(frozen=True)
class Kind:
    """An experiment: what is recorded, what is searched, and what may be wrong."""
    motion: tuple
    truth: str  # mesh, and that of the searches
    searched: str
    ranges: dict  # lowest, highest, values
    wrong: tuple
    held: tuple = ()
    searched_with: tuple = ()  # options of the search
    bound_with: tuple | None = None  # options of the replays of the Cramer-Rao widths, {searched} its mesh; None: no widths
    beside: dict = dataclasses.field(default_factory=dict)  # what a search does not know either: ends of one deviation to both sides
    sides: tuple = (1.0, 1.0)  # of a towel, by which {side} and {cell} of the meshes are replaced [m]
    rates: tuple = ()  # lowest and highest number of keyframes a second; empty: that of the motion
    properties: dict = dataclasses.field(default_factory=dict)  # of the asset


STRIP = {"young": (3, 30, 5), "bending": (5e-5, 2e-3, 7), "friction": (0.15, 0.6, 4)}
STRIP_WRONG = ("damping", "grasp", "weight", "depth", "clock", "diagonals")


def moved(motion, **values):
    """Words of a motion with other values of its options."""
    words = list(motion)
    for name, value in values.items():
        at = next(i for i, word in enumerate(words) if word.split("=")[0] == f"--{name}")
        if "=" in words[at]:
            words[at] = f"--{name}={value}"
        else:
            words[at + 1] = value
    return tuple(words)


SLOPES = ("--clamp-slopes",)
# The main job: a towel held by a patch of 20 mm at its corner, one camera, searched as the README does. Cells of the truth are
# 0.25 mm at the patch's edge and an eighth of that at its corner; elsewhere a sixtieth of the side, or a seventh of the radius of
# the fold in which the towel leaves the table. What is beside: held.cpp.
TOWEL = Kind(("--duration", "3", "--grasp-within", "0.02", "--grasp-cell", "0.00025", "--noise", "0.001", "--rate", "10"),
             "sheet:{side}x{side}:{cell}", "sheet:{side}x{side}:0.02", {"bending": (5e-5, 1e-3, 9), "friction": (0.15, 0.6, 4)},
             ("grasp", "pads", "depth", "weight"), bound_with=("--mesh", "{searched}"),
             beside={"young": (50.0, 200.0), "grasp_size": (0.017, 0.023), "grasp_stiffness": (1e8, 1e12)},
             sides=(0.2, 0.5), rates=(2, 10), properties={"young": 100.0})
KINDS = {
    "corner_lift": TOWEL,
    "corner_lift_four": dataclasses.replace(
        TOWEL, ranges={"bending": (5e-5, 1e-3, 5), "friction": (0.15, 0.6, 3), "young": (30, 300, 3), "poisson": (0.05, 0.45, 2)},
        beside={name: ends for name, ends in TOWEL.beside.items() if name != "young"}),
    "lift": Kind(synthetic.LIFT, synthetic.TRUTH, synthetic.FIT, STRIP, STRIP_WRONG, searched_with=SLOPES, bound_with=SLOPES),
    # Held level by its end, lifted off the table: it hangs over as in a cantilever test.
    "drape": Kind((*moved(synthetic.LIFT, displacement="0,0,0.25"), "--rest", "0.5"), synthetic.TRUTH, synthetic.FIT, STRIP, STRIP_WRONG,
                  searched_with=SLOPES, bound_with=SLOPES),
    # Two opposite sides held, one of them drawn away, its force measured.
    "bar_pull": Kind(synthetic.BAR, synthetic.BAR_MESH, "sheet:0.3x0.3:0.025:alternating",
                     {"young": (20, 200, 5), "poisson": (0.05, 0.45, 5)}, ("damping", "weight", "depth", "clock", "diagonals"),
                     ("--hold", "friction=0.3:measured")),
}
ALSO = {"sampled": ("--posterior", "sampling"), "grids": ("--posterior", "grids")}  # other ways to an answer from the same motions, with their options
TRUTH_STEP = "0.0025"  # of time: a quarter of that of the searches, as cloth takes none [s]
NORMAL = 1.96  # half width of 95 % over the standard deviation
WEIGHT, SCALES = 0.2, 0.004  # areal density as weighed and its standard deviation [kg/m^2]
USUAL = {"young": (10, 2000), "bending": (1.1e-6, 1.1e-4), "friction": (0.1, 1), "poisson": (0, 0.5)}  # against which bits count (verdict.cpp)


def is_logarithmic(name):
    return name != "poisson"


def coordinate(name, value):
    """In which a parameter is even over its range."""
    return math.log(value) if is_logarithmic(name) else value


def draws(seed, what):
    """Of one stream for each seed and each purpose: a truth says nothing of the errors of its recording."""
    return random.Random(f"{what} {seed}")


def truth_of(kind, seed):
    """Even over the searched range."""
    draw = random.Random(seed)
    return {name: low * (high / low) ** draw.random() if is_logarithmic(name) else low + (high - low) * draw.random()
            for name, (low, high, _) in kind.ranges.items()}


def axes(kind):
    return [word for name, (low, high, count) in kind.ranges.items()
            for word in (f"--{name}", f"{low}:{high}:{count}" + (":log" if is_logarithmic(name) else ""))]


def rewrite_points(path, change):
    """Changes the points of a binary cloud."""
    head, body = path.read_bytes().split(b"end_header\n", 1)
    points = numpy.frombuffer(body, dtype="<f4").reshape(-1, 3).astype(float)
    path.write_bytes(head + b"end_header\n" + change(points).astype("<f4").tobytes())


def spoil_depth(recording, seed):
    """2 mm of error that is smooth over 5 cm and the same in all frames, along the view from above."""
    draw = numpy.random.default_rng(seed)
    phases = draw.uniform(0, 2 * math.pi, 2)
    for cloud in sorted((recording / "frames").glob("*.ply")):
        rewrite_points(cloud, lambda p: p + numpy.outer(
            0.002 * math.sqrt(2) * numpy.sin(p[:, 0] / 0.05 + phases[0]) * numpy.sin(p[:, 1] / 0.05 + phases[1]), (0, 0, 1)))


def spoil_clock(recording, seed):
    """Each frame is 10 ms off, by chance."""
    draw = random.Random(seed)
    path = recording / "recording.json"
    record = json.loads(path.read_text())
    for frame in record["keyframes"][1:-1]:
        frame["t"] += max(-0.02, min(0.02, draw.gauss(0, 0.01)))
    path.write_text(json.dumps(record))


def meshes_of(kind, seed):
    """Of the truth and of the search."""
    side = round(draws(seed, "size").uniform(*kind.sides), 3)
    fold = (truth_of(kind, seed).get("bending", math.inf) / (WEIGHT * 9.81)) ** (1 / 3)  # Peirce (1930) [m]
    return tuple(mesh.format(side=side, cell=round(min(side / 60, fold / 7), 5)) for mesh in (kind.truth, kind.searched))


def recorded(runs, asset, kind, seed, wrong):
    """A recording of cloth of the seed's material; `wrong`: what the model is not told of."""
    draw = draws(seed, "errors")
    name = f"recording_{seed}_{wrong or 'right'}"
    fresh = not (runs.out / name / "recording.json").exists()
    words = kind.motion
    fixed = dict(truth_of(kind, seed))
    mesh, searched_mesh = meshes_of(kind, seed)
    if kind.rates:
        words = moved(words, rate=f"{draws(seed, 'rate').uniform(*kind.rates):.2f}")
    if wrong == "damping":
        fixed["air_drag"] = 2.0
    if wrong == "grasp":  # larger by what nobody sees
        at = words[words.index("--grasp-within") + 1]
        words = moved(words, **{"grasp-within": str(float(at) + (0.003 if kind.rates else 0.005))})
    if wrong == "pads":
        fixed["grasp_stiffness"] = 3e8
    fixed["areal_density"] = 1.1 * WEIGHT if wrong == "weight" else round(draw.gauss(WEIGHT, SCALES), 5)
    if wrong == "diagonals":
        mesh = searched_mesh.replace(":alternating", ":alternating_by_row")
    offset = ",".join(f"{draw.gauss(0, 0.003):.5f}" for _ in range(3))
    recording = runs.synth(name, asset, "--mesh", mesh, *words, "--time-step", TRUTH_STEP, "--seed", str(seed), f"--offset-error={offset}",
                           f"--time-offset-error={draw.gauss(0, 0.01):.5f}", *synthetic.settings(fixed))
    if fresh:
        path = recording / "recording.json"
        record = json.loads(path.read_text())
        record["nuisance"] |= BOUNDS
        path.write_text(json.dumps(record))
    if fresh and wrong == "depth":
        spoil_depth(recording, seed)
    if fresh and wrong == "clock":
        spoil_clock(recording, seed)
    return recording


def run_name(seed, wrong, way=None):
    return f"run_{seed}_{wrong or 'right'}" + ("" if way is None else f"_{way}")


def is_finished(out, job, ways=()):
    return all((out / run_name(*job, way) / "summary.json").exists() for way in (None, *ways))


def searched(runs, asset, kind, seed, wrong=None, ways=()):
    """What a search says, and what it says by each of `ways` from the same motions."""
    recording = recorded(runs, asset, kind, seed, wrong)
    weighed = () if wrong == "weight" else ("--hold", f"areal_density={WEIGHT}+-{SCALES}:measured")

    def answer(way):
        more = () if way is None else ALSO[way]
        summary = runs.grid(run_name(seed, wrong, way), [recording], "--asset", asset, "--mesh", meshes_of(kind, seed)[1],
                            *kind.searched_with, *axes(kind), *kind.held, *weighed, "--no-plan", "--rollouts", str(runs.out / "motions"), *more)
        return {"parameters": summary["parameters"], "noise": summary["recordings"][0]["noise_m"],
                "told": any(not r["model_fits"] for r in summary["recordings"]), "seconds": summary["wall_seconds"]}

    return {"seed": seed, "wrong": wrong, "truth": truth_of(kind, seed), "recording": recording} | answer(None) | {
        "also": {way: answer(way) for way in ways}}


def meshes(runs, kind, twin, name, parameters):
    options = [word.format(searched=meshes_of(kind, twin["seed"])[1]) for word in kind.bound_with]
    runs.replay(name, twin["recording"], parameters, "--asset", str(runs.out / "strip.json"), *options, frames="0")
    folder = runs.out / name
    vertices = []
    for path in sorted(folder.glob("*_mesh.ply")):
        head, body = path.read_bytes().split(b"end_header\n", 1)
        count = int(head.split(b"element vertex ")[1].split()[0])
        vertices.append(numpy.frombuffer(body, dtype="<f8", count=3 * count).reshape(-1, 3))
        faces = numpy.frombuffer(body[24 * count:], dtype=[("n", "u1"), ("v", "<i4", 3)])["v"]
    return numpy.array(vertices), faces


def least_spread(runs, kind, twin):
    """Standard deviation of each parameter, of the logarithm where that is even over its range, by Cramer and Rao: all points, white
    noise along the normal, registration and clock unknown, what is `beside` to its deviation, the weight to what the scales tell,
    ranges known."""
    step, name = 0.02, f"bound_{twin['seed']}"
    middle, faces = meshes(runs, kind, twin, name, twin["truth"])
    rates = {}
    for parameter in kind.ranges:
        ends = []
        for sign in (-1, 1):
            other = dict(twin["truth"])
            other[parameter] = other[parameter] * math.exp(sign * step) if is_logarithmic(parameter) else other[parameter] + sign * step
            ends.append(meshes(runs, kind, twin, f"{name}_{parameter}_{sign}", other)[0])
        rates[parameter] = (ends[1] - ends[0]) / (2 * step)
    for parameter, values in kind.beside.items():
        ends = [meshes(runs, kind, twin, f"{name}_{parameter}_{value:g}", twin["truth"] | {parameter: value})[0] for value in values]
        rates[parameter] = (ends[1] - ends[0]) / 2
    record = json.loads((twin["recording"] / "recording.json").read_text())
    times = [frame["t"] for frame in record["keyframes"]]
    speeds = numpy.gradient(middle, numpy.array(times), axis=0)
    truth = json.loads((twin["recording"] / "truth.json").read_text())
    rows = []
    for k, frame in enumerate(record["keyframes"]):
        _, body = (twin["recording"] / frame["cloud"]).read_bytes().split(b"end_header\n", 1)
        points = numpy.frombuffer(body, dtype="<f4").reshape(-1, 3) - numpy.array(truth["offset"])
        x = middle[k]
        normals = numpy.zeros_like(x)
        across = numpy.cross(x[faces[:, 1]] - x[faces[:, 0]], x[faces[:, 2]] - x[faces[:, 0]])
        for corner in range(3):
            numpy.add.at(normals, faces[:, corner], across)
        normals /= numpy.linalg.norm(normals, axis=1, keepdims=True)
        nearest = ((points[:, None, :] - x[None]) ** 2).sum(-1).argmin(1)
        n = normals[nearest]
        changes = {parameter: (rate[k][nearest] * n).sum(1) for parameter, rate in rates.items()}
        young = changes["young"] / (math.log(kind.beside["young"][1] / kind.beside["young"][0]) / 2 if "young" in kind.beside else 1)
        weight = -(young + changes["bending"])  # motion knows stiffness over weight alone
        x_rel = x[nearest] - middle.mean((0, 1))
        yaw = x_rel[:, 0] * n[:, 1] - x_rel[:, 1] * n[:, 0]
        rows.append(numpy.column_stack([*changes.values(), n, yaw, (speeds[k][nearest] * n).sum(1), weight]))
    rows = numpy.concatenate(rows)
    information = rows.T @ rows / twin["noise"] ** 2
    widths = [coordinate(parameter, high) - coordinate(parameter, low) for parameter, (low, high, _) in kind.ranges.items()]
    bounds = [2 * bound for bound in (*BOUNDS["offset_m"], BOUNDS["yaw_rad"], BOUNDS["time_s"])]
    # Even over each range; one deviation; the weight as weighed.
    priors = [*(12 / numpy.square(widths)), *(1 for _ in kind.beside), *(12 / numpy.square(bounds)), (WEIGHT / SCALES) ** 2]
    information += numpy.diag(priors)
    scale = 1 / numpy.sqrt(numpy.diag(information))
    spread = numpy.sqrt(numpy.diag(numpy.linalg.inv(information * numpy.outer(scale, scale)))) * scale
    return dict(zip(kind.ranges, spread))


def could_claim(kind, name, truth, spread):
    """Whether an interval of the Cramer-Rao width about the truth would be a claim, by the rules of verdict.cpp."""
    (first, last), (least, most) = (tuple(coordinate(name, end) for end in ends[:2]) for ends in (kind.ranges[name], USUAL[name]))
    low, high = (coordinate(name, truth) + side * NORMAL * spread for side in (-1, 1))
    open_below, open_above = low < first, high > last
    low = min(least, max(low, first)) if open_below else low
    high = max(most, min(high, last)) if open_above else high
    return not (open_below and open_above) and 2 * (high - low) < most - least


def interval_score(name, finding, truth):
    """Of the logarithm, of nu itself (Gneiting and Raftery 2007): the width, and 40 times what the truth lies outside."""
    low, high = (coordinate(name, end) for end in finding["interval95"])
    x = coordinate(name, truth)
    return high - low + 40 * (max(0, low - x) + max(0, x - high))


def median(values):
    values = sorted(values)
    return values[len(values) // 2] if values else math.nan


def print_right(kind, twins, bounds):
    print("\nThe model is right\n")
    print(f"{'':10} {'twins':>6} {'claims':>7} {'two-sided held':>15} {'one-sided held':>15} {'score':>7} {'width / bound':>14}"
          f" {'the bound would claim':>22}")
    for name in kind.ranges:
        sides = {True: [], False: []}
        for twin in twins:
            finding = twin["parameters"][name]
            held = synthetic.holds(finding, twin["truth"][name])
            if held is not None:
                sides[finding["identifiable"] == "yes"].append((held, twin, finding))
        shares = [f"{sum(h for h, _, _ in sides[two])} of {len(sides[two])}" for two in (True, False)]
        ratios = [(coordinate(name, f["interval95"][1]) - coordinate(name, f["interval95"][0])) / (2 * NORMAL * bounds[twin["seed"]][name])
                  for _, twin, f in sides[True] if twin["seed"] in bounds]
        score = math.nan if not twins else numpy.mean([interval_score(name, twin["parameters"][name], twin["truth"][name]) for twin in twins])
        bounded = [twin for twin in twins if twin["seed"] in bounds]
        claims = sum(could_claim(kind, name, twin["truth"][name], bounds[twin["seed"]][name]) for twin in bounded)
        print(f"{name:10} {len(twins):6} {len(sides[True]) + len(sides[False]):7} {shares[0]:>15} {shares[1]:>15} {score:7.2f} "
              f"{median(ratios):14.2f} {f'{claims} of {len(bounded)}':>22}")


def answered(twins, way):
    """The twins that were answered by `way` too, as that answers them."""
    return [twin | twin["also"][way] for twin in twins if way in twin.get("also", {})]


def print_each(kind, twins, way):
    """Each answer beside that of another way."""
    print(f"\nEach twin: the default | {way}\n")
    print(f"{'seed':>8} {'':10} {'':12} {'truth':>10} {'truth inside':>13} {'width':>17} {'score':>17} {'told':>9} {'seconds':>13}")
    for twin in sorted(twins, key=lambda twin: (twin["seed"], twin["wrong"] or "")):
        pair = (twin, *answered([twin], way))
        for name in kind.ranges:
            truth, ends = twin["truth"][name], [[coordinate(name, end) for end in each["parameters"][name]["interval95"]] for each in pair]
            inside = " | ".join("yes" if low <= coordinate(name, truth) <= high else "no" for low, high in ends)
            widths = " | ".join(f"{high - low:.4f}" for low, high in ends)
            scores = " | ".join(f"{interval_score(name, each['parameters'][name], truth):.4f}" for each in pair)
            told = " | ".join("yes" if each["told"] else "no" for each in pair)
            seconds = " | ".join(f"{each.get('seconds', math.nan):.0f}" for each in pair)
            print(f"{twin['seed']:8} {twin['wrong'] or 'right':10} {name:12} {truth:10.4g} {inside:>13} {widths:>17} {scores:>17} {told:>9} "
                  f"{seconds:>13}")


def print_wrong(kind, twins):
    print("\nThe model is wrong: a claim holds, or the answer says that the model does not fit\n")
    print(f"{'':12} {'twins':>6} {'told':>6} " + " ".join(f"{name + ' held or told':>24}" for name in kind.ranges))
    for wrong in (*kind.wrong, None):
        of_kind = [twin for twin in twins if wrong is None or twin["wrong"] == wrong]
        cells = []
        for name in kind.ranges:
            held = [synthetic.holds(twin["parameters"][name], twin["truth"][name]) for twin in of_kind]
            claimed = [h or twin["told"] for h, twin in zip(held, of_kind) if h is not None]
            cells.append(f"{sum(claimed)} of {len(claimed)} claims")
        print(f"{wrong or 'all':12} {len(of_kind):6} {sum(twin['told'] for twin in of_kind):6} " +
              " ".join(f"{cell:>24}" for cell in cells))


def print_both(kind, twins, bounds):
    print_right(kind, [twin for twin in twins if not twin["wrong"]], bounds)
    print_wrong(kind, [twin for twin in twins if twin["wrong"]])


def read_rows(paths):
    """Twins of earlier calls, and the Cramer-Rao widths of their seeds."""
    twins, bounds = [], {}
    for path in paths:
        for row in json.loads(path.read_text()):
            bound = row.pop("bounds")
            twins.append(row)
            if bound is not None:
                bounds[row["seed"]] = bound
    return twins, bounds


def read_of(answer):
    """What the tables read of an answer; numbers to six digits."""
    def rounded(numbers):
        return None if numbers is None else [float(f"{number:.6g}") for number in numbers]

    parameters = {name: {"identifiable": finding["identifiable"], "interval95": rounded(finding["interval95"])}
                  for name, finding in answer["parameters"].items()}
    return answer | {"parameters": parameters, "noise": float(f"{answer['noise']:.4g}"), "seconds": round(answer["seconds"])}


def write_rows(out, twins, bounds):
    """coverage.json, for read_rows: a line a twin."""
    rows = [read_of(twin) | {"recording": pathlib.Path(twin["recording"]).name, "also": {way: read_of(a) for way, a in twin.get("also", {}).items()},
                             "bounds": bounds.get(twin["seed"]) if not twin["wrong"] else None}
            for twin in sorted(twins, key=lambda twin: (twin["seed"], twin["wrong"] or ""))]
    part = out / "coverage.json.tmp"
    part.write_text("[" + ",\n ".join(json.dumps(row) for row in rows) + "]\n")
    part.replace(out / "coverage.json")
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sysid", required=True, help="the program flash-sysid")
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--kind", choices=KINDS, default="lift", help="the experiment")
    parser.add_argument("--seed", type=int, default=9001, help="of the first twin; the others follow")
    parser.add_argument("--runs", type=int, default=20, help="twins of each half")
    parser.add_argument("--bounds", type=int, help="twins whose Cramer-Rao widths are computed; without it, all; of a pull none, "
                                                  "as they are of points alone")
    parser.add_argument("--jobs", type=int, default=2, help="searches at a time; the same command again goes on where it stopped")
    parser.add_argument("--threads", type=int, help="of each search; without it, as many as there are processors")
    parser.add_argument("--truth-device", help="where recordings are made, as synth --device has it; without it, the processor")
    parser.add_argument("--minutes", type=float, help="after which no search is begun: the tables are of what was done by then")
    parser.add_argument("--rows", nargs="+", type=pathlib.Path, default=[], metavar="FILE",
                        help="coverage.json of earlier calls of the kind: the tables are of their twins, too; with --runs 0, of them alone")
    parser.add_argument("--also", nargs="+", choices=ALSO, default=[], metavar="WAY",
                        help="answer each twin again from the same motions, sampled: by importance sampling, grids: on grids. Tables of each way are "
                             "of the twins that have both answers, and a line of each")
    options = parser.parse_args()
    kind = KINDS[options.kind]
    ways = list(dict.fromkeys(options.also))
    earlier, bounds = read_rows(options.rows)
    runs = kept.Runs(options.sysid, options.out, options.threads, options.truth_device)
    asset = synthetic.write_asset(options.out, **kind.properties)
    seeds = range(options.seed, options.seed + options.runs)
    jobs = [(seed, None) for seed in seeds] + [(seed, kind.wrong[i % len(kind.wrong)]) for i, seed in enumerate(seeds)]
    known = [(twin["seed"], twin["wrong"]) for twin in earlier if all(way in twin.get("also", {}) for way in ways)]
    jobs = [job for pair in zip(jobs[:options.runs], jobs[options.runs:]) for job in pair if job not in known]
    begin = time.monotonic()
    first = 0 if kind.rates else min(1, len(jobs))  # sheets of one size share motions: the first search fills the store
    found = [searched(kept.Runs(options.sysid, options.out, None, options.truth_device), asset, kind, *job, ways)
             for job in jobs[:first]]

    def done(job):
        return with_bound(searched(runs, asset, kind, *job, ways))

    def with_bound(twin):
        bound = least_spread(runs, kind, twin) if not twin["wrong"] and twin["seed"] in bounded else None
        return twin, bound

    bounded = seeds[:options.bounds if kind.bound_with is not None else 0]
    left = None if options.minutes is None else options.minutes - (time.monotonic() - begin) / 60
    # What an earlier call finished counts however little time there is.
    finished = [job for job in jobs[first:] if is_finished(options.out, job, ways)]
    others = [job for job in jobs[first:] if job not in finished]

    def take(task, part, minutes):
        for _, (twin, bound) in kept.each_in_time(task, part, options.jobs, minutes):
            found.append(twin)
            if bound is not None:
                bounds[twin["seed"]] = bound
            write_rows(options.out, found, bounds)  # so that a kill loses no twin

    take(done, finished, None)
    take(done, others, left)
    if ways:  # of what was answered in one way alone, that counts
        taken = [(twin["seed"], twin["wrong"]) for twin in found]
        one_way = [job for job in others if job not in taken and is_finished(options.out, job)]
        take(lambda job: with_bound(searched(runs, asset, kind, *job)), one_way, None)
    if first and found[0]["seed"] in bounded:
        bounds[found[0]["seed"]] = least_spread(runs, kind, found[0])
    taken = [(twin["seed"], twin["wrong"]) for twin in found]
    found += [twin for twin in earlier if (twin["seed"], twin["wrong"]) not in taken]
    rows = write_rows(options.out, found, bounds)
    if not rows:
        print(f"\n{options.kind}: none of {len(jobs)} was searched in time")
        return 1
    print(f"\n{options.kind}, seeds {rows[0]['seed']} to {rows[-1]['seed']}, {len(rows)} of "
          f"{len({*jobs, *((twin['seed'], twin['wrong']) for twin in earlier)})} searched")
    print_both(kind, found, bounds)
    for way in ways:
        both = [twin for twin in found if way in twin.get("also", {})]
        if len(both) < len(found):
            print(f"\nThe default, of the {len(both)} that were answered in both ways")
            print_both(kind, both, bounds)
        print(f"\nAnswered again: {way}, {len(both)} of {len(found)}")
        print_both(kind, answered(both, way), bounds)
        print_each(kind, both, way)
    return 0


if __name__ == "__main__":
    sys.exit(main())
