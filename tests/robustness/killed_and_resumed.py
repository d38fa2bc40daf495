#!/usr/bin/env python3
"""Kills a search, and a fit that goes on from it, at random moments (SIGKILL), resumes it each time, and compares what it leaves with a search that was
left alone: results.csv, registrations.csv and keyframes.csv byte by byte, summary.json but for the seconds it took, and
its digest, which covers them."""
import argparse
import json
import pathlib
import random
import subprocess
import sys
import tempfile
import time

import program

AXES = ["--bending", "2e-5:5e-4:6:log", "--friction", "0.15:0.6:4", "--no-solver-check", "--no-horizon", "--envs", "4"]
FILES = ("results.csv", "registrations.csv", "keyframes.csv")


def contents(folder):
    files = {name: (folder / name).read_bytes() for name in FILES}
    summary = json.loads((folder / "summary.json").read_text())
    summary.pop("wall_seconds"), summary.pop("digest")
    return files | {"summary.json": summary}


def lines(folder):
    """Whole lines after the header."""
    path = folder / "results.csv"
    return max(0, path.read_bytes().count(b"\n") - 1) if path.exists() else 0


def kill_and_resume(command, alone, seconds, most, draw, folder):
    """Kills a command `most` times, and compares what it leaves in the end with what it left `alone`."""
    kills, searches, places = 0, 0, []
    while kills < most:
        out = folder / str(searches)
        searches += 1
        finished = False
        while not finished:
            before = lines(out)
            search = subprocess.Popen([*map(str, command), "--resume", "-o", str(out)], stdout=subprocess.DEVNULL,
                                      stderr=subprocess.PIPE, text=True)
            try:
                # The last kills may come while the summary and the report are written.
                search.wait(timeout=draw.uniform(0.0, 0.4 * seconds) if kills < most else None)
            except subprocess.TimeoutExpired:
                search.kill()
                kills += 1
                places.append(lines(out))
            error = search.communicate()[1]
            finished = search.returncode in (0, 3)
            if not finished and search.returncode != -9:
                sys.exit(f"exit code {search.returncode}: {error}")
            if lines(out) < before:
                sys.exit(f"{before} results became {lines(out)}")
        for name, expected in alone.items():
            if contents(out)[name] != expected:
                sys.exit(f"{name} differs after {kills} kills, at {places} results")
        leftovers = [path.name for path in out.rglob("*.tmp")]
        if leftovers:
            sys.exit(f"left behind: {leftovers}")
    total = alone["results.csv"].count(b"\n") - 1
    print(f"{command[1]}: killed {kills} times in {searches} searches of {total} candidates, at {places} results: "
          "each resumed to the same files")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sysid", required=True, help="the program flash-sysid")
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    draw = random.Random(options.seed)
    with tempfile.TemporaryDirectory() as temporary:
        root = pathlib.Path(temporary)
        asset, recording = program.synthesize(options.sysid, root)
        command = [options.sysid, "grid", recording, "--asset", asset, *AXES, "--quiet"]
        begin = time.monotonic()
        program.must(*command, "-o", root / "alone")
        alone, seconds = contents(root / "alone"), time.monotonic() - begin
        kill_and_resume(command, alone, seconds, options.kills, draw, root / "killed")
        fit = [options.sysid, "fit", recording, "--start", root / "alone", "--asset", asset, "--no-solver-check",
               "--no-horizon", "--quiet"]
        begin = time.monotonic()
        program.must(*fit, "-o", root / "fitted")
        kill_and_resume(fit, contents(root / "fitted"), time.monotonic() - begin, options.kills // 2, draw,
                        root / "killed_fit")


if __name__ == "__main__":
    main()
