#!/usr/bin/env python3
"""Whether the first proposal of `plan` keeps its promise: a strip of known truth is lifted and searched for D and friction,
the experiment that plan ranks first is recorded of the same strip, and both recordings are searched together. The spread
of each parameter should then be what was promised within a factor of LIMIT, and the truth inside the new interval."""
import argparse
import json
import math
import pathlib
import random
import statistics
import subprocess
import sys

import runs as kept
import synthetic

LIMIT = 1.5
RANGES = {"bending": (5e-5, 2e-3, 7), "friction": (0.15, 0.6, 4)}  # lowest, highest, values
BOUNDS = {"offset_m": [0.005, 0.005, 0.005], "yaw_rad": 0.02, "time_s": 0.0}
# As plan simulates its experiments: 2 s, two cameras about the strip.
SEEN = ("--duration", "2", "--rate", "10", "--grasp-within", "0.0201", "--clamp-slopes", "--camera", "0.1,-0.4375,0.38",
        "--camera", "0.42,0.3325,0.34", "--resolution", "64x48", "--noise", "0.001")
KINDS = ("corner_lift", "hang", "drag", "bar_pull", "bias_pull")


def truth_of(seed):
    """Log-uniform over the inner half of the searched range, so that an interval has room."""
    draw = random.Random(seed)
    return {name: low * (high / low) ** (0.25 + 0.5 * draw.random()) for name, (low, high, _) in RANGES.items()}


def recorded(runs, name, asset, seed, truth, *words):
    fresh = not (runs.out / name / "recording.json").exists()
    folder = runs.synth(name, asset, "--mesh", synthetic.TRUTH, *words, "--seed", str(seed), *synthetic.settings(truth))
    if fresh:
        path = folder / "recording.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | {"nuisance": BOUNDS}))
    return folder


def words_of(kind):
    if kind == "hang":
        return ("--kind", kind, "--rest", "1", *SEEN)
    return ("--kind", kind, *(["--forces"] if kind in ("bar_pull", "bias_pull", "drag") else []), *SEEN)


def spreads_of(summary):
    """Standard deviation of the logarithm of each parameter, by the posterior's draws."""
    return {name: statistics.stdev(math.log(row[k]) for row in summary["samples"]) for k, name in enumerate(summary["axes"])}


def planned(runs, name, recording, asset, run):
    path = runs.out / f"{name}.json"
    if not path.exists():
        done = subprocess.run([runs.sysid, "plan", str(recording), "--asset", asset, "--run", str(run), "--mesh", synthetic.FIT,
                               "--clamp-slopes", "--quiet", *runs.threads, "-o", str(path)],
                              capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(done.stderr)
    plan = json.loads(path.read_text())
    first = max(plan["bits"], key=plan["bits"].get)
    promised = {key: next(rank["spread"] for rank in parameter["ranking"] if rank["experiment"] == first)
                for key, parameter in plan["parameters"].items()}
    return first, plan["bits"][first], promised


def followed(runs, asset, seed):
    truth = truth_of(seed)
    search = ("--asset", asset, "--mesh", synthetic.FIT, "--clamp-slopes", *synthetic.axes(RANGES), "--no-plan", *synthetic.WEIGHED,
              "--rollouts", str(runs.out / "motions"))
    lift = recorded(runs, f"lift_{seed}", asset, seed, truth, *synthetic.LIFT)
    before = runs.grid(f"run_{seed}", [lift], *search)
    first, bits, promised = planned(runs, f"plan_{seed}", lift, asset, runs.out / f"run_{seed}")
    words = words_of(first) if first in KINDS else synthetic.LIFT
    second = recorded(runs, f"next_{seed}_{first.replace(' ', '_')}", asset, seed + 500, truth, *words)
    after = runs.grid(f"both_{seed}", [lift, second], *search)
    return {"seed": seed, "truth": truth, "first": first, "bits": bits, "promised": promised, "before": spreads_of(before),
            "after": spreads_of(after), "parameters": after["parameters"]}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sysid", required=True, help="the program flash-sysid")
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--seed", type=int, default=9401)
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("--jobs", type=int, default=1, help="seeds at a time")
    parser.add_argument("--threads", type=int, help="of each search; without it, as many as there are processors")
    parser.add_argument("--minutes", type=float, help="after which no seed is begun")
    options = parser.parse_args()
    runs = kept.Runs(options.sysid, options.out, options.threads)
    asset = synthetic.write_asset(options.out)
    print("seed   proposed         bits  parameter    before  promised     after  after/promised  truth inside")
    ratios, held, table = [], [], []
    seeds = range(options.seed, options.seed + options.runs)
    for seed, case in kept.each_in_time(lambda seed: followed(runs, asset, seed), seeds, options.jobs, options.minutes):
        for name in RANGES:
            low, high = case["parameters"][name]["interval95"]
            ratios.append(case["after"][name] / case["promised"][name])
            held.append(low <= case["truth"][name] <= high)
            table.append(case | {"parameter": name, "ratio": ratios[-1], "held": held[-1]})
            print(f"{seed}   {case['first']:15} {case['bits']:5.1f}  {name:10} {case['before'][name]:8.4f}  {case['promised'][name]:8.4f}"
                  f"  {case['after'][name]:8.4f}  {ratios[-1]:14.2f}  {'yes' if held[-1] else 'no'}", flush=True)
    (options.out / "promise.json").write_text(json.dumps(table, indent=1))
    good = sum(1 / LIMIT <= ratio <= LIMIT for ratio in ratios)
    print(f"within a factor of {LIMIT:g} of what was promised: {good} of {len(ratios)}; truth inside: {sum(held)} of {len(held)}; "
          f"median ratio {statistics.median(ratios):.2f}")
    return 0 if good == len(ratios) else 1


if __name__ == "__main__":
    sys.exit(main())
