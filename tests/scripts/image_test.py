#!/usr/bin/env python3
"""What an image of `make container` has to do: its programs find their libraries and are of one version, a recording that ships is calibrated
and a scene simulated from Python, and none of it as root."""
import argparse
import json
import pathlib
import re
import shlex
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAMS = ("flash-calib", "flash-sysid", "flash-sim")
SHARE = "/opt/flash/share/examples"
SIMULATED = f"""
import flash_sim
sim = flash_sim.RealtimeSim()
sim.load_config("{SHARE}/scenes/fold.json")
sim.set_envs(n_envs=2)
sim.initialize()
sim.step(2)
print(sim.positions("towel").shape[0], all(sim.status()["converged"]))
"""


def statements(run):
    """(holds, what) of each."""
    version = re.search(r"^project\(flash VERSION ([0-9.]+) ", (ROOT / "CMakeLists.txt").read_text(), re.MULTILINE)[1]
    yield run("id", "-u") not in ("0", ""), "the user is not root"
    for program in PROGRAMS:
        yield version in run(program, "--version"), f"{program} is of version {version}"
        linked = run("ldd", f"/opt/flash/bin/{program}")
        yield "libstdc++" in linked and "not found" not in linked, f"{program} finds its libraries"
    answer = json.loads(run("flash-calib", "handeye", f"{SHARE}/handeye/wrist", "--setup", "eye-in-hand", "--target",
                            "charuco:7x5:0.04:0.03:DICT_5X5_100", "--json", "--quiet") or "{}")
    place = answer.get("transform", {}).get("translation", [0, 0, 0])
    # The stated deviations are 0.2, 0.2 and 0.7 mm.
    yield all(abs(a - b) < 2e-3 for a, b in zip(place, (0.05, -0.02, 0.06))), f"the camera is where it is, found {place}"
    cut = run("flash-sysid", "segment", f"{SHARE}/towel_lift/camera1", "--trajectory", f"{SHARE}/towel_lift/gripper.tum", "--times", "rate:10",
              "--force", "-o", "segmented")
    yield "31 frames" in cut, "the cloth is cut out"
    yield run("python", "-c", SIMULATED).strip() == "2 True", "Python simulates a scene"
    yield "usage" in run("python", "-m", "flash_sim.bag", "--help"), "Python reads bags"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--run", required=True, help="what runs a command in the image, as 'docker run --rm flash:0.1.0'")
    options = parser.parse_args()

    def run(*command):
        done = subprocess.run([*shlex.split(options.run), *command], capture_output=True, text=True)
        if done.returncode:
            print(f"{shlex.join(command)[:60]}: ends with {done.returncode}: {done.stderr[-500:]}", file=sys.stderr)
        return done.stdout if done.returncode == 0 else ""

    wrong = 0
    for holds, what in statements(run):
        print(f"{'yes' if holds else 'NO ':4}{what}")
        wrong += not holds
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
