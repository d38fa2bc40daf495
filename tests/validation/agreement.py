#!/usr/bin/env python3
"""Whether a search of two recordings says that they contradict each other: never of one cloth, by chance but once in a hundred
times, and of two cloths wherever their difference matters. Strips as those of coverage.py, each lifted in another way."""
import argparse
import json
import pathlib
import random
import sys
import time

import coverage
import runs as kept
import synthetic

LIFT = coverage.KINDS["lift"]
SECOND = coverage.moved(LIFT.motion, displacement="-0.06,0,0.08")
# What the second recording has of its own; `wrong`: what both have and the model is not told of.
PAIRS = {"one cloth": {}, "one cloth, damped": {"wrong": "air_drag"}, "D 1.4 times": {"bending": 1.4}, "D twice": {"bending": 2},
         "friction twice": {"friction": 2}}


def material(seed):
    """Even over the searched range, as far as twice of each lies in it."""
    draw = random.Random(seed)
    return {name: low * (high / 2 / low) ** draw.random() for name, (low, high, _) in LIFT.ranges.items()}


def recorded(runs, asset, name, seed, words, parameters):
    draw = coverage.draws(seed, "errors")
    offset = ",".join(f"{draw.gauss(0, 0.003):.5f}" for _ in range(3))
    fresh = not (runs.out / name / "recording.json").exists()
    recording = runs.synth(name, asset, "--mesh", LIFT.truth, *words, "--time-step", coverage.TRUTH_STEP, "--seed", str(seed),
                           f"--offset-error={offset}", f"--time-offset-error={draw.gauss(0, 0.01):.5f}", *synthetic.settings(parameters))
    if fresh:
        path = recording / "recording.json"
        record = json.loads(path.read_text())
        record["nuisance"] |= coverage.BOUNDS
        path.write_text(json.dumps(record))
    return recording


def searched(runs, asset, seed, pair):
    change = PAIRS[pair]
    first = material(seed) | {"areal_density": coverage.WEIGHT}
    if "wrong" in change:
        first["air_drag"] = 2.0
    second = {name: value * change.get(name, 1) for name, value in first.items()}
    name = pair.replace(" ", "_").replace(",", "")
    recordings = [recorded(runs, asset, f"{name}_{seed}_a", 2 * seed, LIFT.motion, first),
                  recorded(runs, asset, f"{name}_{seed}_b", 2 * seed + 1, SECOND, second)]
    summary = runs.grid(f"{name}_{seed}", recordings, "--asset", asset, "--mesh", LIFT.searched, "--clamp-slopes", *coverage.axes(LIFT),
                        "--hold", f"areal_density={coverage.WEIGHT}+-{coverage.SCALES}:measured", "--no-plan", "--rollouts",
                        str(runs.out / "motions"))
    changed = next((k for k in LIFT.ranges if k in change), "bending")
    finding = summary["parameters"][changed]
    return {"seed": seed, "pair": pair, "chance": summary["agreement"]["chance"], "excess": summary["agreement"]["excess"],
            "alone": summary["agreement"]["alone"], "axes": summary["axes"], "changed": changed, "first": first, "second": second,
            "finding": finding,
            # Whether the interval of both together leaves out what one of them is.
            "misleads": finding["identifiable"] == "yes" and
            any(synthetic.holds(finding, each[changed]) is False for each in (first, second))}


def print_table(found):
    print(f"\n{'':20} {'pairs':>6} {'told':>6} {'the interval misleads, untold':>30} {'median chance':>14} {'below 5 %':>10}")
    for pair in PAIRS:
        of_pair = [each for each in found if each["pair"] == pair]
        if not of_pair:
            continue
        told = [each["chance"] < 0.01 for each in of_pair]
        untold = sum(each["misleads"] and not t for each, t in zip(of_pair, told))
        print(f"{pair:20} {len(of_pair):6} {sum(told):6} {untold:30} {coverage.median([e['chance'] for e in of_pair]):14.2g} "
              f"{sum(e['chance'] < 0.05 for e in of_pair):10}")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sysid", required=True, help="the program flash-sysid")
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--seed", type=int, default=1, help="of the first material; the others follow")
    parser.add_argument("--runs", type=int, default=20, help="materials, each in every kind of pair")
    parser.add_argument("--jobs", type=int, default=2, help="searches at a time; the same command again goes on where it stopped")
    parser.add_argument("--threads", type=int, help="of each search; without it, as many as there are processors")
    parser.add_argument("--minutes", type=float, help="after which no search is begun: the table is of what was done by then")
    options = parser.parse_args()
    asset = synthetic.write_asset(options.out)
    jobs = [(seed, pair) for seed in range(options.seed, options.seed + options.runs) for pair in PAIRS]
    begin = time.monotonic()
    found = [searched(kept.Runs(options.sysid, options.out), asset, *jobs[0])]  # fills the store
    runs = kept.Runs(options.sysid, options.out, options.threads)
    left = None if options.minutes is None else options.minutes - (time.monotonic() - begin) / 60
    found += [each for _, each in kept.each_in_time(lambda job: searched(runs, asset, *job), jobs[1:], options.jobs, left)]
    (options.out / "agreement.json").write_text(json.dumps(found, indent=1))
    print(f"\nseeds {options.seed} to {options.seed + options.runs - 1}, {len(found)} of {len(jobs)} searched")
    print_table(found)
    return 0


if __name__ == "__main__":
    sys.exit(main())
