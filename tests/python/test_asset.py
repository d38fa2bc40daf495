"""Assets, and materials drawn from them."""
import copy
import json

import numpy as np
import pytest
from conftest import ROOT, TOWEL, start, write_scene

import flash_sim

PARAMETERS = ["young", "bending", "friction", "poisson"]


def samples():
    """64 draws in which bending follows young."""
    random = np.random.default_rng(3)
    young = 1e5 * np.exp(0.2 * random.normal(size=64))
    return np.stack([young, 3e-10 * young, random.uniform(0.2, 0.4, 64), random.uniform(0.2, 0.4, 64)], axis=1)


@pytest.fixture
def tuned(tmp_path):
    """As flash-sysid export writes it; its path."""
    asset = copy.deepcopy(TOWEL)
    asset["identification"] = {
        "interval95": {"young": [7e4, 1.4e5], "bending": [2e-5, 4.5e-5], "friction": None},
        "identifiable": {"young": "yes", "bending": "yes", "friction": "no"},
        "samples": {"parameters": PARAMETERS, "values": samples().tolist()}, "caveats": ["one recording"],
        "units": {"young": "Pa", "thickness": "m", "bending_rigidity": "N m", "friction": "1"}}
    path = tmp_path / "tuned.json"
    path.write_text(json.dumps(asset))
    return path


def test_it_says_what_was_found(tuned):
    asset = flash_sim.Asset(tuned)
    assert asset.values["young"] == 1e5 and asset.units["young"] == "Pa" and asset.units["friction"] == "1"
    assert asset.intervals == {"young": (7e4, 1.4e5), "bending": (2e-5, 4.5e-5)}
    assert asset.verdicts == {"young": "yes", "bending": "yes", "friction": "no"}
    assert asset.is_identified and asset.caveats == ["one recording"]


def test_draws_are_joint_and_each_once_before_any_again(tuned):
    asset = flash_sim.Asset(tuned)
    draws = asset.draws(64, seed=1)
    assert list(draws) == PARAMETERS
    rows = np.stack(list(draws.values()), axis=1)
    assert np.array_equal(np.sort(rows, axis=0)[:, 0], np.sort(samples(), axis=0)[:, 0])
    assert draws["bending"] == pytest.approx(3e-10 * draws["young"])
    more = asset.draws(130, seed=1)
    assert len(set(more["young"][:64])) == 64 and len(set(more["young"][64:128])) == 64
    assert np.array_equal(more["young"][:64], asset.draws(64, 1)["young"])
    assert not np.array_equal(draws["young"], asset.draws(64, seed=2)["young"])
    assert asset.draws(0)["young"].shape == (0,)


def test_what_is_not_identified_has_no_draws():
    asset = flash_sim.Asset(ROOT / "examples" / "assets" / "towel.json")
    assert not asset.is_identified and asset.intervals == {}
    with pytest.raises(ValueError, match="samples: found none"):
        asset.draws(3)
    for path in ("nowhere.json", None, 3, ROOT):
        with pytest.raises((ValueError, TypeError)):
            flash_sim.Asset(path)


def test_environments_have_identified_materials(tuned, tmp_path):
    sim = start(write_scene(tmp_path, objects={"towel": "tuned.json"}), 5)
    drawn = sim.randomize("identified", seed=4)["towel"]
    material = sim.material()
    assert all(np.array_equal(material[name], drawn[name]) for name in drawn)
    known = samples()
    for e in range(5):  # E t = young times the thickness, and what goes with that young
        row = known[np.argmin(np.abs(known[:, 0] - material["membrane_stiffness"][e] / 0.001))]
        assert material["membrane_stiffness"][e] == row[0] * 0.001 and material["bending_rigidity"][e] == row[1]
        assert material["friction"][e] == row[2] and material["poissons_ratio"][e] == row[3]
    assert (material["areal_density"] == 0.2).all() and len(set(material["friction"])) == 5
    sim.step()
    assert (sim.status()["lost"] == 0).all()


def test_published_ranges_and_none(scene):
    sim = start(scene, 400, seed=9)
    start_material = sim.material()
    sim.randomize("published")
    for name in ("membrane_stiffness", "bending_rigidity", "areal_density", "friction"):
        factor = sim.material()[name] / start_material[name]
        assert factor.min() >= 0.5 and factor.max() <= 1.5
        assert factor.mean() == pytest.approx(1, abs=4 * 0.289 / 20)  # 4 standard errors of an even spread
    sim.randomize("published", env_ids=[3])
    sim.randomize("none", env_ids=[0, 1])
    assert sim.material()["friction"][:2].tolist() == [0.3, 0.3] and sim.material()["friction"][3] != 0.3
    other = start(scene, 400, seed=9)
    sim.seed(9)
    assert np.array_equal(sim.randomize("published")["towel"]["friction"], other.randomize("published")["towel"]["friction"])


def test_friction_that_would_change_nothing_is_refused_or_left_out(tmp_path):
    sim = start(write_scene(tmp_path, obstacles={"table": {"shape": "plane", "normal": [0, 0, 1], "friction": 0.5}}), 2)
    with pytest.raises(ValueError, match="friction: found obstacles that all state their own"):
        sim.set_material(friction=0.1)
    assert set(sim.randomize("published")["towel"]) >= {"bending_rigidity"} and (sim.material()["friction"] == 0.3).all()
    sim.add_ee("hand", [0, 0, 1])  # which states none
    sim.set_material(friction=0.1)
    assert (sim.material()["friction"] == 0.1).all()
