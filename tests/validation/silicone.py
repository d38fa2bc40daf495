#!/usr/bin/env python3
"""Young's modulus of two silicone parts that sag, from one cloud of a lidar each: on linear tetrahedra, extrapolated from the
authors' mesh and that split in eight, on quadratic ones of the authors' mesh alone, and with 15 mm less in the clamp."""
import argparse
import json
import pathlib
import re
import subprocess
import sys

POISSON, DENSITY = 0.49, 1080  # -, [kg/m^3]
CLAMP, LOOSE = -0.0175, -0.0025  # held from this x on, as the authors say, and 15 mm less [m]
# Without the clamp's frame, which begins at -0.045, what lies below the part and what lies behind it [m].
CROP = {"min": [None, -0.17, -0.03], "max": [-0.045, None, None]}
OFFSET = [0.02, 0.02, 0.02]  # of the cloud, which is not in the mesh's frame to the millimetre [m]
SECONDS = 30  # of hanging
PARTS = {"MoldStar 15": ("h_m_c", "8e4:4.8e5:6:log"), "Ecoflex 00-50": ("h_e_c", "3e4:1.8e5:6:log")}


# What is searched: order of the tetrahedra, where the clamp begins, whether the mesh is split too.
CASES = {"linear, both meshes": (1, CLAMP, True), "linear": (1, CLAMP, False), "linear, 15 mm less in the clamp": (1, LOOSE, False),
         "quadratic": (2, CLAMP, False)}


def recording(folder, data, stem, clamp):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "recording.json").write_text(json.dumps({
        "schema": "flash-recording/1", "name": stem, "kind": "cantilever", "gravity": [0, -9.81, 0],
        "object": {"mesh": str(data / f"{stem}_rest.vtk"), "start": {"T_base_object": [0, 0, 0, 0, 0, 0, 1]}},
        "supports": [{"name": "clamp", "from": 0, "select": {"box": {"min": [clamp - 1e-4, None, None]}}}],
        "keyframes": [{"t": SECONDS, "cloud": str(data / f"{stem}_cloud.ply")}], "crop": CROP,
        "nuisance": {"offset_m": OFFSET, "yaw_rad": 0.0, "time_s": 0.0}}))
    return folder


def asset(path, mesh, order):
    path.write_text(json.dumps({
        "schema": "flash-asset/1", "mesh": str(mesh), "element_type": "TETRAHEDRON", "element_order": order,
        "mechanical_props": {"density": DENSITY, "young": 1e5, "poisson": POISSON, "constitutive": "TET_NEOHOOKEAN"}}))
    return path


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sysid", required=True, help="the program flash-sysid")
    parser.add_argument("--data", required=True, type=pathlib.Path, help="folder of the clouds and meshes")
    parser.add_argument("--out", required=True, type=pathlib.Path)
    options = parser.parse_args()
    data = options.data.resolve()
    print("| part | elements | E kPa | 95 % | mean distance mm | offset mm |\n|---|---|---|---|---|---|")
    for part, (stem, young) in PARTS.items():
        for name, (order, clamp, split) in CASES.items():
            folder = recording(options.out / f"{stem} {name}", data, stem, clamp)
            silicone = asset(folder / "asset.json", data / f"{stem}_rest.vtk", order)
            done = subprocess.run(
                [options.sysid, "grid", str(folder), "--asset", str(silicone), "--young", young, "--hold", f"poisson={POISSON}:measured",
                 "--hold", f"density={DENSITY}:measured", "--time-step", "1", "--tolerance", "1e-6", "--no-horizon", "--no-plan",
                 *([] if split else ["--no-solver-check"]), "--quiet", "--force", "-o", str(folder / "run")],
                capture_output=True, text=True)
            if done.returncode != 0:
                sys.exit(done.stderr)
            found = json.loads((folder / "run" / "summary.json").read_text())["parameters"]["young"]
            low, high = found["interval95"]
            distance, offset = re.search(r"([\d.]+) mm from .*offset (.*) mm, clock", done.stdout).groups()
            print(f"| {part} | {name} | {found['estimate'] / 1e3:.0f} | {low / 1e3:.0f} to {high / 1e3:.0f} | {distance} | {offset} |",
                  flush=True)


if __name__ == "__main__":
    main()
