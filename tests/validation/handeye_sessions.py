#!/usr/bin/env python3
"""Recordings of one mount must agree: calibrates each and prints where they put the camera, how far apart, and whether
that is within what each states.

    tests/validation/handeye_sessions.py build/release/bin/flash-calib ../shared/data/handeye/eih_ur_chessboard_{1,2,3}"""
import argparse
import json
import math
import pathlib
import subprocess
import tempfile


def calibrated(program, dataset, options, out):
    subprocess.run([program, "handeye", dataset, *options, "--quiet", "--force", "-o", out], capture_output=True)
    return json.loads(out.read_text())


def in_parent(result):
    """Standard deviations of the translation [mm] along the axes it is written in."""
    x, y, z, w = result["transform"]["rotation_xyzw"]
    R = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
         [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
         [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    C = result["covariance"]
    return [1000 * math.sqrt(sum(R[k][i] * C[i][j] * R[k][j] for i in range(3) for j in range(3))) for k in range(3)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("datasets", nargs="+")
    parser.add_argument("--options", default="", help="for flash-calib handeye, as one word")
    options = parser.parse_args()
    places, deviations = [], []
    with tempfile.TemporaryDirectory() as folder:
        for dataset in options.datasets:
            result = calibrated(options.program, dataset, options.options.split(), pathlib.Path(folder) / "camera.json")
            places.append([1000 * x for x in result["transform"]["translation"]])
            deviations.append(in_parent(result))
            size = result["scale"]
            print(f"{pathlib.Path(dataset).name:28}", " ".join(f"{x:8.2f}" for x in places[-1]), "mm, +-",
                  " ".join(f"{x:5.2f}" for x in deviations[-1]), f"| size {size['estimate']:.4f} +- {size['sd']:.4f}")
    count = len(places)
    mean = [sum(axis) / count for axis in zip(*places)]
    spread = [math.sqrt(sum((x - m) ** 2 for x in axis) / (count - 1)) for axis, m in zip(zip(*places), mean)]
    farthest = max(abs(x - m) / s for place, sd in zip(places, deviations) for x, m, s in zip(place, mean, sd))
    print("spread x y z", " ".join(f"{s:.2f}" for s in spread), f"mm, norm {math.sqrt(sum(s * s for s in spread)):.2f} mm;",
          f"farthest from the mean: {farthest:.1f} of its standard deviations")


if __name__ == "__main__":
    main()
