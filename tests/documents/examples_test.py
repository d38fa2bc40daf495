#!/usr/bin/env python3
"""The recordings of examples/ are what the commands of their README make: depth to a millimetre, corners in pictures to a hundredth of
a pixel, numbers of other files to their last digit. --write puts what is made in their place."""
import argparse
import filecmp
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import commands

EXAMPLES = commands.ROOT / "examples"
TARGET = "charuco:7x5:0.04:0.03:DICT_5X5_100"
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
KEPT = {"towel_lift": ("camera1", "gripper.tum", "truth.json"), "handeye": ("wrist", "beside")}


def make(example, out, path):
    """What the README's commands leave, in out; a command that makes the folder itself leaves it there under its name."""
    out.mkdir()
    (out / "examples").symlink_to(EXAMPLES)
    for _, lines, _ in commands.blocks((EXAMPLES / example / "README.md").read_text()):
        for line in lines:
            subprocess.run(line, shell=True, cwd=out, check=True, env={**os.environ, "PATH": f"{path}:{os.environ['PATH']}"},
                           stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return out / example if (out / example).is_dir() else out


def kept(folder, names):
    return sorted(path.relative_to(folder) for name in names
                  for path in [folder / name, *(folder / name).rglob("*")] if path.is_file())


def same_numbers(a, b, tolerance):
    """Whether two texts differ by rounding alone; tolerance in the units of their numbers, where they are of order 1."""
    if NUMBER.sub("#", a) != NUMBER.sub("#", b):
        return False
    pairs = zip(map(float, NUMBER.findall(a)), map(float, NUMBER.findall(b)))
    return all(abs(x - y) <= tolerance * max(1, abs(x)) for x, y in pairs)


def same_depth(a, b):
    """A pixel on the border of the cloth may see the table instead, where another processor rounds another way."""
    try:
        import numpy
    except ImportError:
        sys.exit("skipped: numpy is not there")
    sys.path.insert(0, str(commands.ROOT / "tests/validation"))
    import depth_png
    x, y = depth_png.read(a).astype(int), depth_png.read(b).astype(int)
    return x.shape == y.shape and numpy.mean(numpy.abs(x - y) > 1) < 1e-3


def corners(calib, folder):
    done = subprocess.run([calib, "detect", folder, "--target", TARGET, "--json", "--quiet"], check=True, capture_output=True, text=True)
    return done.stdout


def differences(shipped, made, names, calib):
    here, there = kept(shipped, names), kept(made, names)
    if here != there:
        yield f"{shipped}: has {len(here)} files, the commands of its README make {len(there)}"
        return
    for path in here:
        a, b = shipped / path, made / path
        if path.suffix == ".jpg" or filecmp.cmp(a, b, shallow=False):
            continue
        if not (same_depth(a, b) if path.suffix == ".png" else same_numbers(a.read_text(), b.read_text(), 1e-9)):
            yield f"{a}: is not what the commands of its README make"
    for folder in sorted({path.parts[0] for path in here if path.suffix == ".jpg"}):
        pictures = [path for path in here if path.suffix == ".jpg" and path.parts[0] == folder]
        if all(filecmp.cmp(shipped / path, made / path, shallow=False) for path in pictures):
            continue
        if not same_numbers(corners(calib, shipped / folder), corners(calib, made / folder), 0.01):
            yield f"{shipped / folder}: corners in its pictures are not those that the commands of its README make"


def write(shipped, made, names):
    for name in names:
        shutil.rmtree(shipped / name, ignore_errors=True)
        (shutil.copytree if (made / name).is_dir() else shutil.copyfile)(made / name, shipped / name)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bin", required=True, type=pathlib.Path, help="the folder of the programs")
    parser.add_argument("--draw", required=True, type=pathlib.Path, help="the program rendered_dataset")
    parser.add_argument("--write", action="store_true", help="put what is made into examples/")
    options = parser.parse_args()
    path = f"{options.bin.resolve()}:{options.draw.resolve().parent}"
    wrong, size = [], 0
    with tempfile.TemporaryDirectory() as folder:
        for example, names in KEPT.items():
            made = make(example, pathlib.Path(folder) / f"of_{example}", path)
            if options.write:
                write(EXAMPLES / example, made, names)
            wrong += differences(EXAMPLES / example, made, names, options.bin / "flash-calib")
            size += sum((EXAMPLES / example / path).stat().st_size for path in kept(EXAMPLES / example, names))
    if size > 5e6:
        wrong.append(f"the recordings of examples/ take {size / 1e6:.1f} MB, expected 5 at most")
    if wrong:
        sys.exit("\n".join(wrong))
    print(f"{', '.join(KEPT)}: {size / 1e6:.1f} MB, as the commands of their README make them")


if __name__ == "__main__":
    main()
