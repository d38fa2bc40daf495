#!/usr/bin/env python3
"""Whether compare tells how a strip was grasped. Each twin is held by a patch of 12.5 or of 19 mm, drawn by lot, and searched as
either; with --points by a patch of 12.5 mm or by one point. Prints a row a twin; then how often the truth was the likelier, and
the mean probability that it was given."""
import argparse
import json
import pathlib
import random
import subprocess
import sys

import runs as kept
import synthetic

RANGES = {"young": (3, 30, 3), "bending": (5e-5, 2e-3, 9), "friction": (0.15, 0.6, 3)}
SIZES = {"short": ("--grasp-within", "0.0126"), "long": ("--grasp-within", "0.0189")}
SHAPES = {"patch": ("--grasp-within", "0.0126"), "point": ("--grasp-within", "0.0126", "--grasp-shape", "point")}


def lift():
    words = [word for word in synthetic.LIFT if word != "--clamp-slopes"]
    at = words.index("--grasp-within")
    return words[:at] + words[at + 2:]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sysid", required=True, help="the program flash-sysid")
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--seed", type=int, default=13001)
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--points", action="store_true", help="a patch or one point, in place of patches of two sizes")
    options = parser.parse_args()
    models = SHAPES if options.points else SIZES
    names = tuple(models)
    runs = kept.Runs(options.sysid, options.out)
    asset = synthetic.write_asset(options.out)
    right, given = 0, []
    print("seed   truth  excess of the other  probability of the truth", flush=True)
    for seed in range(options.seed, options.seed + options.runs):
        draw = random.Random(seed)
        shape = draw.choice(names)
        truth = {name: low * (high / low) ** draw.random() for name, (low, high, _) in RANGES.items()}
        recording = runs.synth(f"recording_{seed}", asset, "--mesh", synthetic.TRUTH, *lift(), *models[shape], "--seed", str(seed),
                               *synthetic.settings(truth))
        for each in names:
            runs.grid(f"{each}_{seed}", [recording], "--asset", asset, "--mesh", synthetic.FIT, *models[each], "--no-plan", *synthetic.axes(RANGES), *synthetic.WEIGHED)
        told = subprocess.run([options.sysid, "compare", *(str(options.out / f"{each}_{seed}") for each in names), "--json"],
                              capture_output=True, text=True)
        if told.returncode != 0:
            sys.exit(told.stderr)
        searches = dict(zip(names, json.loads(told.stdout)["searches"]))
        other = names[1 - names.index(shape)]
        probability = searches[shape]["probability"]
        print(f"{seed}  {shape:5}  {searches[other]['excess'] - searches[shape]['excess']:19.1f}  {probability:24.3g}", flush=True)
        right += probability > 0.5
        given.append(probability)
    print(f"the truth is the likelier in {right} of {len(given)}; mean probability {sum(given) / len(given):.2f}; "
          f"below 0.05 in {sum(p < 0.05 for p in given)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
