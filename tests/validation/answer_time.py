#!/usr/bin/env python3
"""How long it takes from kept motions to the answer: four parameters, seven nuisances, two recordings of 25 keyframes, over
narrow ranges and wide ones. The search is run once; the answer is then determined again from its motions, with nothing left
to simulate. Exits with 1 where that takes longer than --limit on two threads."""
import argparse
import json
import pathlib
import resource
import subprocess
import sys
import time

import runs as kept
import synthetic

BOUNDS = {"offset_m": [0.01, 0.01, 0.01], "yaw_rad": 0.02, "time_s": 0.03, "start_yaw_rad": 0.02, "table_height_m": 0.001}
LIFTS = {"first": "-0.03,0,0.06", "second": "-0.05,0,0.05"}  # paths of the gripper [m]
RANGES = {"narrow": {"young": "6:16:3:log", "poisson": "0.2:0.4:3", "bending": "1.4e-4:2.8e-4:3:log", "friction": "0.25:0.36:3:log"},
          "wide": {"young": "3:30:3:log", "poisson": "0:0.45:3", "bending": "5e-5:2e-3:5:log", "friction": "0.15:0.6:3:log"}}


def recorded(runs, asset, name, path, seed):
    words = list(synthetic.LIFT)
    words[words.index("--duration") + 1] = "1.2"  # 25 keyframes at 20 a second
    at = next(i for i, word in enumerate(words) if word.startswith("--displacement"))
    words[at] = f"--displacement={path}"
    fresh = not (runs.out / name / "recording.json").exists()
    folder = runs.synth(name, asset, "--mesh", synthetic.TRUTH, *words, "--seed", str(seed))
    if fresh:
        record = json.loads((folder / "recording.json").read_text())
        record["nuisance"] |= BOUNDS
        (folder / "recording.json").write_text(json.dumps(record))
    return folder


def processor_seconds():
    """That the programs called so far have taken."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def told(summary):
    for name, finding in summary["parameters"].items():
        low, high = finding["interval95"] or (float("nan"), float("nan"))
        print(f"    {name:10} {finding['identifiable']:12} {finding['estimate']:.6g} ({low:.6g} to {high:.6g})")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sysid", required=True, help="the program flash-sysid")
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--limit", type=float, default=10, help="seconds that an answer may take")
    parser.add_argument("--only", choices=RANGES, help="one of the ranges")
    options = parser.parse_args()
    runs = kept.Runs(options.sysid, options.out)
    asset = synthetic.write_asset(options.out)
    recordings = [recorded(runs, asset, name, path, seed) for seed, (name, path) in enumerate(LIFTS.items(), 1)]
    late = []
    for name, ranges in RANGES.items():
        if options.only not in (None, name):
            continue
        words = [word for key, values in ranges.items() for word in (f"--{key}", values)]
        search = [*map(str, recordings), "--asset", asset, "--mesh", synthetic.FIT, "--clamp-slopes", *words, *synthetic.WEIGHED, "--threads", "2",
                  "--quiet", "-o", str(options.out / name)]
        for attempt in ("first", "again"):  # the first simulates what is not kept yet
            begin, worked = time.monotonic(), processor_seconds()
            done = subprocess.run([options.sysid, "grid", *search, "--resume"], capture_output=True, text=True)
            seconds = time.monotonic() - begin
            if done.returncode not in (0, 3):
                sys.exit(done.stderr)
            print(f"{name}, {attempt}: {seconds:.1f} s, of processors {processor_seconds() - worked:.1f} s", flush=True)
        told(json.loads((options.out / name / "summary.json").read_text()))
        if seconds > options.limit:
            late.append(name)
    if late:
        print(f"longer than {options.limit:g} s: {', '.join(late)}")
    return 1 if late else 0


if __name__ == "__main__":
    sys.exit(main())
