#!/usr/bin/env python3
"""What programs print as JSON names its schema and version, and has no field that docs/formats.md does not name.
Also: `validate` ends with 3 where the target has moved since the calibration, `replay` where steps did not converge."""
import argparse
import json
import math
import pathlib
import re
import sys
import tempfile

import documented
import program


# Parameters, experiments, settings.
BY_NAME = ("parameters", "fixed", "held", "nuisance", "shift", "spread", "spread_before", "bits", "differs", "fingerprint", "settings")


def multiply(a, b):
    """Poses as (rotation, translation)."""
    rotation = [[sum(a[0][i][k] * b[0][k][j] for k in range(3)) for j in range(3)] for i in range(3)]
    return rotation, [sum(a[0][i][k] * b[1][k] for k in range(3)) + a[1][i] for i in range(3)]


def inverse(pose):
    rotation = [[pose[0][j][i] for j in range(3)] for i in range(3)]
    return rotation, [-sum(rotation[i][k] * pose[1][k] for k in range(3)) for i in range(3)]


def quaternion_of(rotation):
    w = math.sqrt(max(0, 1 + rotation[0][0] + rotation[1][1] + rotation[2][2])) / 2
    return [(rotation[2][1] - rotation[1][2]) / (4 * w), (rotation[0][2] - rotation[2][0]) / (4 * w),
            (rotation[1][0] - rotation[0][1]) / (4 * w), w]


def turned(axis, angle, translation):
    """A turn by `angle` about the coordinate axis, then a shift."""
    c, s, i, j = math.cos(angle), math.sin(angle), (axis + 1) % 3, (axis + 2) % 3
    rotation = [[float(row == column) for column in range(3)] for row in range(3)]
    rotation[i][i], rotation[i][j], rotation[j][i], rotation[j][j] = c, -s, s, c
    return rotation, translation


def named(pose):
    x, y, z, w = quaternion_of(pose[0])
    return {"translation": dict(zip("xyz", pose[1])), "rotation": {"x": x, "y": y, "z": z, "w": w}}


def write_hand_eye(folder):
    """An exact calibration of an eye in the hand, samples that it predicts, and samples of a target that moved."""
    camera, target = turned(2, 0.3, [0.05, 0, 0.06]), turned(2, 0.4, [0.4, 0.1, 0])
    form = lambda pose, parent, child: {"parent": parent, "child": child, "translation": pose[1],
                                        "rotation_xyzw": quaternion_of(pose[0])}
    (folder / "camera.json").write_text(json.dumps(
        {"schema": "flash-extrinsics/2", "setup": "eye-in-hand", "method": "errors_in_variables",
         "transform": form(camera, "gripper", "camera"), "target_pose": form(target, "base", "target"),
         "covariance": [[1e-8 if i == j else 0 for j in range(6)] for i in range(6)], "warnings": [], "exit_code": 0}))
    for name, shift in (("stands", 0), ("moved", 0.02)):
        place = (target[0], [target[1][0] + shift, *target[1][1:]])
        samples = []
        for k in range(8):
            gripper = multiply(turned(k % 3, 0.2 + 0.05 * k, [0.3 + 0.02 * k, 0.1, 0.5]), turned((k + 1) % 3, 0.25, [0, 0, 0]))
            samples.append({"robot": named(gripper),
                            "tracking": named(multiply(inverse(multiply(gripper, camera)), place))})
        (folder / f"{name}.samples").write_text(json.dumps({"samples": samples}))


def outputs(options, folder):
    """Name and text of each JSON, and the exit codes that are right with it."""
    asset, recording = program.synthesize(options.sysid, folder)
    synth = [options.sysid, "synth", "--asset", asset, "--mesh", "sheet:0.2x0.2:0.05:alternating", "--kind", "corner_lift",
             "--duration", "0.6"]
    axes = ["--bending", "5e-5:5e-4:3:log", "--no-solver-check", "--no-horizon"]
    (folder / "scene.json").write_text(json.dumps(
        {"schema": "flash-scene/1", "timestep": 0.01, "steps": 2, "gravity": [0, 0, -9.81], "objects": {"cloth": "asset.json"}}))
    write_hand_eye(folder)
    for words, codes in (
            ([*synth, "--seed", "2", "-o", folder / "again"], (0,)),
            ([options.sysid, "repeatability", recording, folder / "again"], (0,)),
            ([options.sysid, "replay", recording, "--asset", asset, "-o", folder / "replayed"], (0,)),
            ([options.sysid, "replay", recording, "--asset", asset, "--iterations", "1", "--tolerance", "1e-9",
              "-o", folder / "unconverged"], (3,)),
            ([options.sysid, "plan", recording, "--asset", asset, "--bending", "5e-5:5e-4:3:log", "-o", folder / "plan.json"], (0,)),
            ([options.sysid, "grid", recording, "--asset", asset, *axes, "-o", folder / "run"], (0, 3)),
            ([options.sysid, "plan", recording, "--asset", asset, "--run", folder / "run", "-o", folder / "known.json"], (0,)),
            ([options.sysid, "grid", recording, "--asset", asset, *axes, "--grasp-shape", "point", "-o", folder / "pointed"], (0, 3)),
            ([options.sysid, "compare", folder / "run", folder / "pointed"], (0,)),
            ([options.sysid, "predict", folder / "run", folder / "again"], (0, 3)),
            ([options.sysid, "report", folder / "run"], (0,)),
            ([options.sysid, "export", folder / "run", "-o", folder / "tuned.json"], (0, 3)),
            ([options.sysid, "import", recording / "frames", "--trajectory", recording / "gripper.tum", "--times", "rate:10",
              "--mesh", "sheet:0.2x0.2:0.01", "--grasp-within", "0.03", "-o", folder / "imported"], (0,)),
            ([options.sim, "run", folder / "scene.json", "-o", folder / "out"], (0,)),
            ([options.sim, "bench", "--vertices", "20", "--envs", "1", "--steps", "2"], (0,)),
            ([options.calib, "validate", folder / "stands.samples", "--extrinsics", folder / "camera.json"], (0,)),
            ([options.calib, "validate", folder / "camera.json", "--extrinsics", folder / "camera.json"], (0,)),
            ([options.calib, "validate", folder / "moved.samples", "--refit-target", "--extrinsics", folder / "camera.json"], (0,)),
            ([options.calib, "validate", folder / "moved.samples", "--extrinsics", folder / "camera.json"], (3,))):
        done = program.call(*words, "--json")
        name = " ".join(str(word) for word in words[:3])
        if done.returncode not in codes:
            sys.exit(f"{name}: exit code {done.returncode}, expected {codes}: {done.stderr}")
        if "validate" in name and codes == (3,) and "target is not where it was" not in done.stderr:
            sys.exit(f"{name}: does not say that the target has moved: {done.stderr}")
        yield name, done.stdout
    yield "grid.json", (folder / "run" / "grid.json").read_text()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("sim", "sysid", "calib"):
        parser.add_argument(f"--{name}", required=True, help=f"the program flash-{name}")
    parser.add_argument("--formats", required=True, type=pathlib.Path, help="docs/formats.md")
    options = parser.parse_args()
    text = options.formats.read_text()
    known, count, wrong = documented.fields_by_schema(text), 0, []
    with tempfile.TemporaryDirectory() as temporary:
        for name, output in outputs(options, pathlib.Path(temporary)):
            fields = json.loads(output)
            schema = fields.get("schema", "")
            if f"`{schema}`" not in text and f'"{schema}"' not in text or not re.fullmatch(r"flash-[a-z-]+/\d+", schema):
                sys.exit(f"{name}: schema \"{schema}\" is not in {options.formats}")
            missing = set(documented.unnamed(fields, known.get(schema, set()), BY_NAME))
            wrong += [f"{name}: {schema}: {options.formats} does not name {path}" for path in sorted(missing)]
            count += 1
    if wrong:
        sys.exit("\n".join(wrong))
    print(f"{count} outputs have the fields of their documents")


if __name__ == "__main__":
    main()
