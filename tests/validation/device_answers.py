#!/usr/bin/env python3
"""Recorded lifts and lifts that other simulators made, searched on the processor and on a CUDA device: whether both give the
same answer. Verdicts have to be the same, and of what is told estimates and ends of intervals within a tenth of the interval."""
import argparse
import json
import math
import pathlib
import sys

import lifts
import other_simulators
import runs as kept

SHARE = 0.1  # of an interval
WINDOW = ["--from", "1.0", "--until", "2.4", "--mesh", lifts.MESH, "--no-plan", "--no-solver-check"]
# Limp cloths at a hundredth of the default tolerance: on the way to its folds such a cloth takes one of several ways, and at
# 1e-3 rounding decides which.
REAL = {
    "lift_paper": [*lifts.GRASPS["point"], "--bending", "2e-4:4e-3:5:log", "--start-yaw", "0.1,0.2,0.3"],
    "lift_tan": [*lifts.GRASPS["pinch"], "--bending", "3e-5:1e-3:5:log", "--start-yaw", "-0.15,0,0.15", "--tolerance", "1e-5"],
    "lift_navy": [*lifts.GRASPS["pinch"], "--bending", "3e-6:1e-4:5:log", "--start-yaw", "-0.05,0.1,0.25", "--tolerance", "1e-5"],
}


def differences(here, there):
    """Lines of a table: each parameter by both answers; and how many differ."""
    lines, differ = [], 0
    for key, own in here["parameters"].items():
        other = there["parameters"][key]
        low, high = own["interval95"] or (math.nan, math.nan)
        pairs = [(own["estimate"], other["estimate"]), *zip(own["interval95"] or [], other["interval95"] or [])]
        logarithmic = all(number > 0 for pair in pairs for number in pair)
        scale = math.log if logarithmic else float
        width = scale(high) - scale(low)
        share = max((abs(scale(a) - scale(b)) / width for a, b in pairs), default=0)
        told = own["identifiable"] != "no"
        same = own["identifiable"] == other["identifiable"] and not (told and share > SHARE)
        differ += not same
        lines.append(f"    {key:12} {own['identifiable']:12} {own['estimate']:.5g} ({low:.5g} to {high:.5g}); device: "
                     f"{other['identifiable']}, off by {share:.3f} of the interval{'' if same else ': DIFFERS'}")
    return lines, differ


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sysid", required=True, help="the program flash-sysid, built with CUDA")
    parser.add_argument("--data", required=True, type=pathlib.Path, help="folder with lift/ and twin/")
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--only", action="append", help="a recording, may be given again")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    cloth = lifts.write_asset(options.out)
    towel = options.out / "towel.json"
    towel.write_text(json.dumps(other_simulators.ASSET, indent=2) + "\n")
    searches = {name: ([options.data / "lift" / name], ["--asset", cloth, *WINDOW, *words]) for name, words in REAL.items()}
    for name, weight in other_simulators.WEIGHED.items():
        ranges = [word for key, values in other_simulators.RANGES.items() for word in (f"--{key}", values)]
        searches[name] = ([options.data / "twin" / name], ["--asset", str(towel), "--mesh", other_simulators.MESH, *ranges, "--hold",
                                                           f"areal_density={weight}", "--no-plan", "--no-solver-check"])
    runs = kept.Runs(options.sysid, options.out)
    failed = 0
    for name, (recordings, words) in searches.items():
        if options.only and name not in options.only:
            continue
        here, there = (runs.grid(f"{name}/{device}", recordings, *words, "--device", device) for device in ("cpu", "cuda"))
        lines, differ = differences(here, there)
        scores = [{row["id"]: row["score_m"] for row in search["rows"]} for search in (here, there)]
        apart = sorted(abs(score - scores[1][candidate]) for candidate, score in scores[0].items())
        print(f"{name}: {len(apart)} candidates, scores apart by {1e6 * apart[len(apart) // 2]:.2g} um in the median, "
              f"{1e6 * apart[-1]:.2g} at most; {here['wall_seconds']:.0f} s and {there['wall_seconds']:.0f} s")
        print("\n".join(lines), flush=True)
        failed += differ
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
