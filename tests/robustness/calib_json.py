#!/usr/bin/env python3
"""Every field of what flash-calib prints as JSON, at any depth, is one that docs/formats.md names."""
import argparse
import itertools
import json
import pathlib
import sys
import tempfile

import documented
import program
from calib_traps import knocked_before, poses_changed

BOARD = "chessboard:9x6:0.025"
BY_NAME = ("comparison", "parameters")  # methods; coefficients of a lens
EXPECTED = ("splits.knock.other_transform", "splits.place_3.chi_square", "smooth_errors.reach", "depth.over_corners",
            "comparison.park.behind.px", "scale.warp_mm", "predicted_sd.repeatable_parent_mm", "clouds.views.tilt_deg",
            "one_axis.camera_axis", "one_axis.measured.height_m", "bases.workspace_sd_mm", "scales.wanted", "poses.translation_sd_mm", "views.readings.pixels", "parameters.fx.sd")


def draw(tool, work):
    size, robot = "640x480", ("0.02", "0.2")
    program.must(tool, work / "wrist", "eye-in-hand", BOARD, 16, size, *robot, 1, "depth_mm=1")
    program.must(tool, work / "knocked", "eye-in-hand", BOARD, 18, size, *robot, 4)
    poses_changed(knocked_before(9))(work / "knocked")
    program.must(tool, work / "one_axis", "eye-in-hand", BOARD, 16, size, *robot, 5, "motion=one-axis")
    for name, seed in (("left", 2), ("right", 3)):
        program.must(tool, work / name, "eye-to-hand", BOARD, 12, size, *robot, seed)


def outputs(calib, work):
    """Name and text of each JSON."""
    cache = ("--cache", work / "cache")
    for name in ("wrist", "knocked", "left", "right"):
        done = program.must(calib, "handeye", work / name, "-o", work / name / "camera.json", "--json", *cache)
        yield f"handeye {name}", done.stdout
    solved = json.loads((work / "left/camera.json").read_text())["views"]
    form = lambda pose: {"translation": dict(zip("xyz", pose[:3])), "rotation": dict(zip("xyzw", pose[3:]))}
    (work / "pairs.samples").write_text(json.dumps({"samples": [
        {"robot": form(view["base_gripper"]), "tracking": form(view["camera_target"])} for view in solved if view["used"]]}))
    left = json.loads((work / "left/camera.json").read_text())
    (work / "touched.csv").write_text("x,y,z,u,v\n" + "".join(touched(left)))
    for words in (("handeye", work / "pairs.samples", "--setup", "eye-to-hand"),
                  ("handeye", work / "one_axis", "--target-height", "0:0.005", *cache),
                  ("register", work / "left/camera.json", work / "right/camera.json", "--workspace", "0.4,0,0.1", *cache),
                  ("register", work / "left/camera.json", work / "right/camera.json", "--without-images"),
                  ("validate", work / "wrist", "--extrinsics", work / "wrist/camera.json", *cache),
                  ("validate", work / "pairs.samples", "--extrinsics", work / "left/camera.json"),
                  ("plan", work / "wrist", "--count", "2", *cache), ("intrinsics", work / "wrist", *cache),
                  ("detect", work / "wrist", *cache),
                  ("validate", "--touched", work / "touched.csv", "--extrinsics", work / "left/camera.json"),
                  ("export", work / "wrist/camera.json", "--to", "usd", "-o", work / "camera.usda")):
        yield " ".join(map(str, words[:2])), program.must(calib, *words, "--json").stdout


def touched(answer):
    """Places before a camera that were touched, and their pixels, near enough to its axis for a lens without distortion."""
    (cx, cy), (fx, fy), place = (answer[key][name] for key, name in (("lens", "centre_px"), ("lens", "focal_px"), ("transform", "translation")))
    R = program.rotation_of(answer["transform"]["rotation_xyzw"])
    for z, x, y in itertools.product((0.8, 1.2), (-0.1, 0.1), (-0.1, 0.1)):
        there = [at + sum(r * c for r, c in zip(row, (x, y, z))) for at, row in zip(place, R)]
        yield ",".join(map(str, (*there, cx + fx * x / z, cy + fy * y / z))) + "\n"


def paths(value, path=""):
    if isinstance(value, list):
        for item in value:
            yield from paths(item, path)
    if isinstance(value, dict):
        for key, item in value.items():
            here = f"{path}.{key}".lstrip(".")
            yield here
            yield from paths(item, here)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--calib", required=True, help="the program flash-calib")
    parser.add_argument("--draw", required=True, help="the program rendered_dataset")
    parser.add_argument("--formats", required=True, type=pathlib.Path, help="docs/formats.md")
    options = parser.parse_args()
    known = documented.fields_by_schema(options.formats.read_text())
    wrong, count, seen = [], 0, set()
    with tempfile.TemporaryDirectory() as temporary:
        work = pathlib.Path(temporary)
        draw(options.draw, work)
        for name, text in outputs(options.calib, work):
            fields = json.loads(text)
            missing = set(documented.unnamed(fields, known.get(fields["schema"], set()), BY_NAME))
            wrong += [f"{name}: {options.formats} does not name {path}" for path in sorted(missing)]
            seen |= set(paths(fields))
            count += 1
    wrong += [f"no output has {path}, which is to be looked at" for path in EXPECTED if path not in seen]
    print("\n".join([*wrong, f"{count} outputs, {len(seen)} fields"]))
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
