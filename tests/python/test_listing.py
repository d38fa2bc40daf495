"""The published listing, to the letter, on scenes of every kind."""
import json
import re
import sys

import numpy as np
import pytest
from conftest import ROOT, SHARED

import flash_sim

LISTING = '''
import flash_sim
sim = flash_sim.RealtimeSim(); sim.load_config("path/to/scene.json"); sim.set_envs(n_envs=128); sim.initialize()
sim.add_ee("left", start_pose_l, size=[0.05]*3); sim.add_ee("right", start_pose_r, size=[0.05]*3)
for step in range(1000):
    sim.move_ee("left", pose_l); sim.grasp_ee("left", grasp_l); sim.move_ee("right", pose_r); sim.grasp_ee("right", grasp_r)
    sim.step()
'''


def run_listing(path, poses, grasp, n_envs=128, steps=1000, device="auto"):
    """The listing with a path, a number of environments, a length and a device; its simulation."""
    text = LISTING.replace("path/to/scene.json", str(path)).replace("128", str(n_envs)).replace("1000", str(steps))
    text = text.replace("RealtimeSim()", f"RealtimeSim({device!r})")
    left, right = poses
    names = {"start_pose_l": left, "start_pose_r": right, "pose_l": left, "pose_r": right, "grasp_l": grasp,
             "grasp_r": grasp}
    exec(text, names)
    return names["sim"]


def expect_run(sim, n_envs, steps):
    status = flash_sim.to_host(sim.status())
    assert (status["steps"] == steps).all() and (status["lost"] == 0).all(), sim.why_lost()
    for body in sim.bodies:
        positions = flash_sim.to_host(sim.positions(body))
        assert positions.shape[0] == n_envs and np.isfinite(positions).all()


APART = ([0, 0, 0.5, 0, 0, 0, 1], [0.5, 0, 0.5, 0, 0, 0, 1])  # above what lies on a table


def test_as_it_stands_on_128_environments_of_a_published_scene(tmp_path, device):
    """Without a schema, in the published format: each hand holds the corner below it."""
    asset = {"mesh": "towel.obj", "element_type": "TRIANGLE",
             "mechanical_props": {"obj_mass": 0.008, "young": 100, "poisson": 0.3, "constitutive": "TRI_COROTATED",
                                  "bending": 1e-5, "friction": 0.3}}
    n = 6
    vertices = [f"v {0.04 * i} {0.04 * j} 0" for j in range(n) for i in range(n)]
    faces = [f"f {a + 1} {b + 1} {c + 1}" for j in range(n - 1) for i in range(n - 1) for o in [n * j + i]
             for a, b, c in [(o, o + 1, o + n + 1), (o, o + n + 1, o + n)]]
    (tmp_path / "towel.obj").write_text("\n".join(vertices + faces) + "\n")
    (tmp_path / "towel.json").write_text(json.dumps(asset))
    (tmp_path / "published.json").write_text(json.dumps({
        "timestep": 0.01, "gravity": [0, 0, -9.81], "planecollisions": {"point": [0, 0, 0], "normal": [0, 0, 1]},
        "objects": {"towel": "towel.json"}}))
    poses = ([0, 0, 0.0255, 0, 0, 0, 1], [0.2, 0.2, 0.0255, 0, 0, 0, 1])
    grasp = np.arange(128) % 2 == 0
    sim = run_listing(tmp_path / "published.json", poses, grasp, steps=20, device=device)
    assert sim.device.startswith(device)
    expect_run(sim, 128, 20)
    for hand in ("left", "right"):
        assert ((sim.held(hand) > 0) == grasp).all()


@pytest.mark.parametrize("name, n_envs", [("gripper", 2), ("fold", 2), ("incline_stick", 2), ("two_plus_two", 2), ("chair", 2),
                                          ("tshirt_fold", 1)])
def test_on_our_own_scenes(name, n_envs):
    path = ROOT / "examples" / "scenes" / f"{name}.json"
    expect_run(run_listing(path, APART, False, n_envs=n_envs, steps=2), n_envs, 2)


@pytest.mark.parametrize("name", ["lift11_corot", "slide_h0.01", "equil_hang2_corot", "tetdrop_corot"])
def test_on_the_reference_scenes(name, tmp_path):
    scenes = SHARED / "reference" / "scenes"
    if not scenes.is_dir():
        pytest.skip(f"{scenes} is absent")
    sys.path.insert(0, str(ROOT / "tests" / "reference"))
    import run  # what writes reference scenes as files that flash reads
    scene = json.loads((scenes / f"{name}.json").read_text())
    path = run.scene_files.write(scene, run.read_vertices(scenes / scene["mesh"]), tmp_path, scenes)
    expect_run(run_listing(path, APART, False, n_envs=2, steps=3), 2, 3)


def test_listings_of_the_cameras_stand_alone(tmp_path, monkeypatch):
    """Each by itself, from the root of the repository, as a reader would copy it."""
    listings = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "cameras.md").read_text(), re.S)
    monkeypatch.chdir(ROOT)
    seen = []
    for listing in listings:
        names = {}
        exec(listing.replace("fold.pgm", str(tmp_path / "fold.pgm")), names)
        seen.append(names.get("seen", names.get("depth")))
    assert len(seen) == 2 and (tmp_path / "fold.pgm").stat().st_size == 15 + 320 * 240
    assert seen[0].min() > 0 and 0.05 < (seen[1] > 0).mean() < 0.5  # a table behind all, and the towel alone
