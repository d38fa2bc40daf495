"""How fast scenes step from Python beside C++: 128 environments of 1,024 vertices, a hand that is moved in each step.

Usage: python_rate.py [--device cpu] [--environments 128] [--steps 60] [--rounds 3] [--side 32]

Each round goes from the same state through the same motion, once by a loop of Python, which takes the positions as well, and
once by a loop of C++, in turn. Prints steps a second of both, and the rate of the best rounds. Asked: 0.98."""
import argparse
import json
import pathlib
import tempfile
import time

import numpy as np

import flash_sim

ASSET = {"schema": "flash-asset/1", "element_type": "TRIANGLE",
         "mechanical_props": {"areal_density": 0.2, "thickness": 0.001, "young": 1e5, "poisson": 0.3,
                              "constitutive": "TRI_COROTATED", "bending_rigidity": 3e-5, "friction": 0.3}}
SCENE = {"schema": "flash-scene/1", "timestep": 0.01, "steps": 10, "gravity": [0, 0, -9.81],
         "obstacles": {"table": {"shape": "plane", "normal": [0, 0, 1]}}, "objects": {"towel": "towel.json"}}
EDGE = 0.3  # of the towel [m]


def start(arguments):
    sim = flash_sim.RealtimeSim(arguments.device)
    with tempfile.TemporaryDirectory() as folder:
        asset = ASSET | {"mesh": f"sheet:{EDGE}x{EDGE}:{EDGE / (arguments.side - 1)}"}
        (pathlib.Path(folder) / "towel.json").write_text(json.dumps(asset))
        (pathlib.Path(folder) / "scene.json").write_text(json.dumps(SCENE))
        sim.load_config(pathlib.Path(folder) / "scene.json")
        sim.set_envs(arguments.environments)
        sim.initialize()
    sim.add_ee("hand", [EDGE, EDGE, 0.01], size=[0.03, 0.03, 0.02], reach=0.002)
    sim.grasp_ee("hand", True)
    sim.step()
    return sim


def from_python(sim, poses):
    """Seconds of the steps."""
    began = time.perf_counter()
    for pose in poses:
        sim.move_ee("hand", pose)
        sim.step()
        sim.positions()
    return time.perf_counter() - began


def from_cpp(sim, poses):
    return sim._simulation.time_steps("hand", np.repeat(poses[:, None], sim.n_envs, axis=1))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--device", default="cpu")
    for name, default in (("environments", 128), ("steps", 60), ("rounds", 3), ("side", 32)):
        parser.add_argument(f"--{name}", type=int, default=default)
    arguments = parser.parse_args()
    sim = start(arguments)
    count = arguments.steps
    print(f"{arguments.environments} environments of {sim.positions().shape[1]} vertices on {sim.device}, {count} steps", flush=True)
    poses = np.tile([EDGE, EDGE, 0, 0, 0, 0, 1.0], (count, 1))
    poses[:, 2] = 0.01 + 1e-3 * np.arange(1, count + 1)
    state = sim.save_state()
    ways = {"Python": from_python, "C++": from_cpp}
    seconds = {name: [] for name in ways}
    for number in range(arguments.rounds + 1):
        for name, way in ways.items():
            sim.load_state(state)
            taken = way(sim, poses if number else poses[:5])  # the first warms up
            if number:
                seconds[name].append(taken)
    for name, rounds in seconds.items():
        print(f"{name:6} {count / min(rounds):9.2f} steps a second; rounds of " + ", ".join(f"{each:.3f}" for each in rounds) + " s")
    print(f"rate of Python over C++: {min(seconds['C++']) / min(seconds['Python']):.3f} (asked: 0.98)")


if __name__ == "__main__":
    main()
