#!/usr/bin/env python3
"""A woven square of known E_1, E_2 and G, pulled along its warp and along its diagonal: both pulls together tell all three, the
pull along the warp does not tell G, and an isotropic law is refused in one line."""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

MESH = "sheet:0.2x0.2:0.025:alternating"
TRUTH = {"young": 100, "young_ratio": 0.4, "shear_ratio": 0.2}
CAMERAS = ["--camera", "0.1,0.0,0.5", "--camera", "0.25,0.25,0.4", "--resolution", "96x72", "--noise", "0.001"]
# The cells of both meshes divide the patch that the gripper takes.
PULL = ["--forces", "--grasp-within", "0.026", "--duration", "0.6", "--rest", "0.2", "--rate", "10", *CAMERAS]
SEARCH = ["--mesh", MESH, "--young", "50:200:5:log", "--young-ratio", "0.2:1:4:log", "--shear-ratio", "0.1:1:4:log",
          *(word for name in ("poisson=0.3", "friction=0.3", "areal_density=0.2") for word in ("--hold", name + ":measured")),
          "--no-horizon", "--no-plan"]


def asset(path, **props):
    path.write_text(json.dumps({
        "schema": "flash-asset/1", "mesh": MESH.replace("0.025", "0.0125"), "element_type": "TRIANGLE",
        "mechanical_props": {"areal_density": 0.2, "young": 100, "poisson": 0.3, "constitutive": "TRI_STVK",
                             "bending_rigidity": 1e-5, **props}}))
    return path


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sysid", required=True)
    sysid = str(pathlib.Path(parser.parse_args().sysid).resolve())
    with tempfile.TemporaryDirectory() as temporary:
        check(sysid, pathlib.Path(temporary))


def check(sysid, folder):
    def run(*words, code=0):
        done = subprocess.run([sysid, *map(str, words)], capture_output=True, text=True, cwd=folder)
        if done.returncode != code:
            sys.exit(f"{' '.join(done.args)}: exit code {done.returncode}, expected {code}\n{done.stderr}")
        return done

    def found(name):
        return json.loads((folder / name / "summary.json").read_text())["parameters"]

    woven, plain = asset(folder / "woven.json", **TRUTH), asset(folder / "plain.json")
    for seed, kind in enumerate(("bar_pull", "bias_pull"), 5):
        run("synth", "--asset", woven, "--kind", kind, *PULL, "--seed", seed, "-o", kind)
    run("grid", "bar_pull", "bias_pull", "--asset", plain, *SEARCH, "-o", "both")
    for name, truth in TRUTH.items():
        finding = found("both")[name]
        low, high = finding["interval95"]
        assert finding["identifiable"] == "yes" and low < truth < high, (name, finding)
    run("export", "both", "-o", "tuned.json")
    props = json.loads((folder / "tuned.json").read_text())["mechanical_props"]
    assert all(abs(props[name] / truth - 1) < 0.05 for name, truth in TRUTH.items()), props

    run("grid", "bar_pull", "--asset", plain, *SEARCH, "--no-solver-check", "-o", "warp")
    assert found("warp")["shear_ratio"]["identifiable"] == "no", found("warp")["shear_ratio"]

    corotated = asset(folder / "corotated.json", constitutive="TRI_COROTATED")
    refused = run("grid", "bar_pull", "--asset", corotated, *SEARCH, "-o", "refused", code=2).stderr.strip().split("\n")
    assert refused == ["flash-sysid: --young-ratio: found constitutive TRI_COROTATED, expected TRI_STVK, the only one that is "
                       "woven"], refused
    assert not (folder / "refused").exists()


if __name__ == "__main__":
    main()
