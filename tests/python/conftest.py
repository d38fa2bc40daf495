import json
import os
import pathlib

import pytest

import flash_sim

ROOT = pathlib.Path(__file__).resolve().parents[2]
SHARED = pathlib.Path(os.environ.get("FLASH_SHARED_DIR", ROOT.parent / "shared"))

TOWEL = {"schema": "flash-asset/1", "mesh": "sheet:0.2x0.2:0.04", "element_type": "TRIANGLE",
         "mechanical_props": {"areal_density": 0.2, "thickness": 0.001, "young": 1e5, "poisson": 0.3,
                              "constitutive": "TRI_COROTATED", "bending_rigidity": 3e-5, "friction": 0.3}}


def write_scene(folder, asset=TOWEL, **changes):
    """A scene of a coarse towel of 36 vertices on a table; its path."""
    (folder / "towel.json").write_text(json.dumps(asset))
    scene = {"schema": "flash-scene/1", "timestep": 0.01, "steps": 10, "gravity": [0, 0, -9.81],
             "obstacles": {"table": {"shape": "plane", "normal": [0, 0, 1]}}, "objects": {"towel": "towel.json"}}
    (folder / "scene.json").write_text(json.dumps(scene | changes))
    return str(folder / "scene.json")


def start(path, n_envs=1, device="cpu", **settings):
    sim = flash_sim.RealtimeSim(device, **settings)
    sim.load_config(path)
    sim.set_envs(n_envs=n_envs)
    sim.initialize()
    return sim


@pytest.fixture(params=["cpu", "cuda"])
def device(request):
    """Each in turn; a CUDA device that is not there is skipped."""
    try:
        flash_sim.RealtimeSim(request.param)
    except ValueError as error:
        pytest.skip(str(error))
    return request.param


@pytest.fixture
def scene(tmp_path):
    return write_scene(tmp_path)


@pytest.fixture
def sim(scene, device):
    """Three environments with an end effector over a corner of the towel."""
    sim = start(scene, 3, device)
    sim.add_ee("hand", [0.2, 0.2, 0.05], size=[0.06, 0.06, 0.02], reach=0.002)
    return sim
