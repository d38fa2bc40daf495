#!/usr/bin/env python3
"""Two arms on one camera are registered by what their calibrations were made with: register takes what handeye --for two-arms
accepted, with a lens that the pictures exclude too, and a size that handeye took for unknown stays unknown."""
import argparse
import json
import pathlib
import re
import sys
import tempfile

import program

BOARD = "chessboard:9x6:0.025"
ARMS = ("left", "right")


def draw(tool, work):
    for seed, arm in enumerate(ARMS, 2):
        program.must(tool, work / arm, "eye-to-hand", BOARD, 16, "640x480", "0.02", "0.2", seed)


def with_focal_length(work, factor):
    """Of both recordings, as their files state it: the first and the fifth number of the matrix."""
    for arm in ARMS:
        path = work / arm / "camera_info.yaml"
        head, numbers, tail = re.match(r"(.*?camera_matrix:.*?data: \[)(.*?)(\].*)", path.read_text(), re.DOTALL).groups()
        matrix = [float(number) for number in numbers.split(",")]
        matrix[0] *= factor
        matrix[4] *= factor
        path.write_text(head + ", ".join(map(repr, matrix)) + tail)


def calibrated(calib, work, name, *options):
    """Both calibrations, and how they ended."""
    files = [work / f"{arm}_{name}.json" for arm in ARMS]
    ends = [program.call(calib, "handeye", work / arm, *options, "-o", path, "--cache", work / "cache")
            for arm, path in zip(ARMS, files)]
    return files, ends


def registered(calib, work, files, *options):
    return program.call(calib, "register", *files, "--json", "--cache", work / "cache", *options)


def check_two_arms(calib, work):
    for name, factor in (("true", 1), ("long", 1.03)):
        with_focal_length(work, factor)
        files, ends = calibrated(calib, work, name, "--for", "two-arms")
        for end in ends:
            yield end.returncode == 0, f"handeye --for two-arms, lens {name}: exit code {end.returncode}: {end.stderr}"
            yield (factor == 1) == ("the lens is not as stated" not in end.stderr), f"lens {name}: {end.stderr}"
        done = registered(calib, work, files)
        yield done.returncode == 0, f"register of what two-arms accepted, lens {name}: exit code {done.returncode}: {done.stderr}"
        yield "--stated-intrinsics" not in done.stderr and "--lens stated" not in done.stderr, done.stderr
        yield json.loads(done.stdout)["exit_code"] == 0, f"register, lens {name}: {done.stdout}"
        with_focal_length(work, 1 / factor)


def check_sizes(calib, work):
    for name, options, unknown in (("usual", (), False), ("solved", ("--target-size", "solved"), True)):
        files, ends = calibrated(calib, work, name, *options)
        for end in ends:
            yield end.returncode == 0, f"handeye {options}: exit code {end.returncode}: {end.stderr}"
        done = registered(calib, work, files)
        yield done.returncode == 0, f"register after handeye {options}: exit code {done.returncode}: {done.stderr}"
        known = [size["prior_sd"] for size in json.loads(done.stdout)["scales"]]
        yield len(known) == 2 and all((sd is None) == unknown for sd in known), f"register after handeye {options}: {known}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--calib", required=True, help="the program flash-calib")
    parser.add_argument("--draw", required=True, help="the program rendered_dataset")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        work = pathlib.Path(temporary)
        draw(options.draw, work)
        results = [result for check in (check_two_arms, check_sizes) for result in check(options.calib, work)]
    sys.exit(program.conclude(results))


if __name__ == "__main__":
    main()
