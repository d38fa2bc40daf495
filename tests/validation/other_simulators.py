#!/usr/bin/env python3
"""Lifts that other simulators made, searched as by somebody who knows the cloth's size and its weight by a scale: whether
what is claimed of E t, D and friction holds, or the answer says that the model does not fit. D of these meshes is that of
their energy on their diagonals, which bends like 0.80 to 1.00 of the nominal."""
import argparse
import json
import math
import pathlib
import sys

import runs as kept

ASSET = {"schema": "flash-asset/1", "mesh": "sheet:0.4x0.4:0.01", "element_type": "TRIANGLE",
         "mechanical_props": {"areal_density": 0.2, "young": 50, "poisson": 0.3, "constitutive": "TRI_COROTATED",
                              "bending_rigidity": 3e-5, "friction": 0.4}}
MESH = "sheet:0.4x0.4:0.02"  # twice the cells of the recordings; cells of half the size are simulated too
RANGES = {"young": "10:300:4:log", "bending": "1e-5:1e-3:5:log", "friction": "0.15:0.6:3:log"}
WEIGHED = {"lift_g": "0.2:measured", "lift_mujoco_1": "0.2:measured", "lift_mujoco_2": "0.19+-0.0095:measured"}
BENDS_LIKE = (0.80, 1.00)  # of the nominal D


def truths(folder):
    """Least and greatest value that may be called the truth."""
    truth = json.loads((folder / "truth.json").read_text())
    membrane = truth.get("Et", truth["E"] * truth.get("thickness", 1e-3))
    return {"young": (membrane, membrane), "bending": tuple(share * truth["D"] for share in BENDS_LIKE),
            "friction": (truth["mu"], truth["mu"])}


def holds(finding, least, greatest):
    """None where nothing is claimed."""
    verdict = finding["identifiable"]
    if verdict == "no":
        return None
    low, high = finding["interval95"]
    return (verdict == "upper_bound" or low <= greatest) and (verdict == "lower_bound" or least <= high)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sysid", required=True, help="the program flash-sysid")
    parser.add_argument("--data", required=True, type=pathlib.Path, help="folder of the recordings")
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--only", choices=WEIGHED)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    runs = kept.Runs(options.sysid, options.out)
    asset = options.out / "asset.json"
    asset.write_text(json.dumps(ASSET, indent=2) + "\n")
    failed = 0
    for name, weight in WEIGHED.items():
        if options.only not in (None, name):
            continue
        words = [word for key, values in RANGES.items() for word in (f"--{key}", values)]
        summary = runs.grid(name, [options.data / name], "--asset", str(asset), "--mesh", MESH, *words, "--hold",
                            f"areal_density={weight}", "--no-plan")
        fits = all(recording["model_fits"] for recording in summary["recordings"])
        recording = summary["recordings"][0]
        print(f"{name}: {'fits' if fits else 'does not fit'}; score {1e3 * summary['best']['score']:.2f} mm, noise "
              f"{1e3 * recording['noise_m']:.2f}, misfit {1e3 * recording['misfit_m']:.2f}")
        for key, (least, greatest) in truths(options.data / name).items():
            finding = summary["parameters"][key]
            held = holds(finding, least, greatest)
            low, high = finding["interval95"] or (math.nan, math.nan)
            failed += held is False and fits
            print(f"    {key:10} {finding['identifiable']:12} {finding['estimate']:.4g} ({low:.4g} to {high:.4g}), truth "
                  f"{least:.4g} to {greatest:.4g}: {'nothing claimed' if held is None else 'holds' if held else 'does not hold'}",
                  flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
