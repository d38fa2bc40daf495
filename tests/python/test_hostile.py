"""Calls that are wrong: each is an exception that names it, and nothing has changed."""
import itertools

import numpy as np
import pytest
from conftest import start, write_scene

import flash_sim
from flash_sim.device_array import DeviceArray

NAN, INF = float("nan"), float("inf")
BAD_POSES = [NAN, [NAN] * 7, [0, 0, INF], [0] * 7, [0, 0, 0, 0, 0, 0, 2], [0] * 6, [[0] * 7] * 2, np.zeros((3, 3, 7)), "up", None,
             [1e300, 0, 0], ["a"] * 3, {}, [[0], [0, 1]], np.zeros((0, 7)), 1j, [True] * 7]
BAD_IDS = [3, -1, [0, 0], [True], [1.5], "all", [[0, 1]], 10**20, [None], {}]
BAD_NAMES = ["", "foot", None, 3, ["hand"], "towel\0", "\ud800"]
BAD_STATES = [np.zeros((3, 36)), np.full((3, 36, 3), NAN), np.zeros((2, 36, 3)), np.zeros((3, 35, 3)), "x", 5, {"foot": 0}]
BAD_COUNTS = [-1, 1.5, "2", None, 2**40, True]
BAD_NUMBERS = [NAN, -1, "soft", [0.1, 0.2], np.full((3, 1), 0.1), -INF, None]

CALLS = [
    *[("move_ee", ("hand", pose)) for pose in BAD_POSES],
    *[("move_ee", (name, [0, 0, 1])) for name in BAD_NAMES],
    *[("move_ee", ("hand", [0, 0, 1], ids)) for ids in BAD_IDS],
    *[("grasp_ee", ("hand", grasp)) for grasp in ["yes", 1, None, [True, False], [0.5] * 3, np.ones((3, 1), bool)]],
    *[("add_ee", (name, [0, 0, 1])) for name in [*BAD_NAMES[:1], None, 3, "hand", "table", "\ud800"]],
    *[("add_ee", ("new", pose)) for pose in BAD_POSES],
    *[("add_ee", ("new", [0, 0, 1], size)) for size in [0, [0, 1, 1], [-1] * 3, [NAN] * 3, [1, 1], "big", [1e300] * 3]],
    *[("add_ee", ("new", [0, 0, 1], [0.05] * 3, reach)) for reach in [-1, NAN, "far", [0.1, 0.1]]],
    *[("add_ee", ("new", [0, 0, 1], [0.05] * 3, 0.01, friction)) for friction in [-1, NAN, "rough"]],
    *[("step", (count,)) for count in BAD_COUNTS],
    *[(view, (name,)) for view in ("positions", "velocities", "force", "pose", "held", "material", "triangles")
      for name in ("", "foot", 3)],
    *[("reset", (ids,)) for ids in BAD_IDS],
    *[("reset", (None, state)) for state in BAD_STATES],
    *[("reset", (None, None, state)) for state in BAD_STATES],
    *[("set_velocities", ("towel", state)) for state in BAD_STATES],
    *[("save_state", (ids,)) for ids in BAD_IDS],
    *[("load_state", (state,)) for state in [None, 3, "state", np.zeros(3)]],
    *[("set_gravity", (gravity,)) for gravity in [NAN, [0, 0], [NAN] * 3, "down", np.zeros((2, 3))]],
    *[("set_friction", ("towel", "table", value)) for value in BAD_NUMBERS],
    *[("set_friction", ("towel", name, 0.3)) for name in BAD_NAMES],
    *[("randomize", (how,)) for how in ["all", None, "identified"]],  # the towel was not identified
    *[("randomize", ("none", seed)) for seed in [-1, 0.5, "x"]],
    *[("seed", (seed,)) for seed in [-1, 0.5, "x", None]],
    *[("set_envs", (count,)) for count in [0, -5, 1.5, "3", None, 10**12]],
    *[("load_config", (path,)) for path in ["nowhere.json", None, 5, "/", "", "a\0b", "a\udfff", b"\xff"]],
]
MATERIALS = [{name: value} for name, value in itertools.product(
    ("membrane_stiffness", "areal_density", "friction", "poissons_ratio"), [NAN, -2, "soft", [0.1, 0.2], None])]
MATERIALS += [{"stiffness": 1}, {"membrane_stiffness": 0}, {"friction": 0.1, "foot": 1}]


def snapshot(sim):
    return [flash_sim.to_host(a) for a in (sim.positions(), sim.velocities(), sim.pose("hand"), *sim.material().values())]


def expect_refusal(sim, call, arguments, named=True):
    before = snapshot(sim)
    with pytest.raises((ValueError, TypeError)) as raised:
        getattr(sim, call)(*arguments) if isinstance(arguments, tuple) else getattr(sim, call)(**arguments)
    text = str(raised.value)
    assert "\n" not in text and "incompatible function arguments" not in text, text
    assert "found" in text or "No such file" in text or call == "load_config", text
    for old, new in zip(before, snapshot(sim)):
        assert np.array_equal(old, new, equal_nan=True), text


def test_there_are_a_hundred():
    assert len(CALLS) + len(MATERIALS) > 100


def test_every_bad_call_is_refused_by_name(sim):
    for call, arguments in CALLS:
        expect_refusal(sim, call, arguments)
    for values in MATERIALS:
        expect_refusal(sim, "set_material", values)
    sim.step()
    assert (flash_sim.to_host(sim.status())["lost"] == 0).all()


METHODS = [("step",), ("positions",), ("velocities",), ("force", "hand"), ("pose", "hand"), ("held", "hand"), ("status",),
           ("why_lost",), ("reset",), ("save_state",), ("load_state", None), ("set_velocities", "towel", 0), ("material",),
           ("set_material",), ("set_friction", "towel", "table", 0.3), ("set_gravity", [0, 0, -1]), ("randomize", "none"),
           ("add_ee", "hand", [0, 0, 1]), ("move_ee", "hand", [0, 0, 1]), ("grasp_ee", "hand", True), ("triangles",), ("asset",)]


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method[0])
def test_use_before_initialize(method, scene):
    sim = flash_sim.RealtimeSim()
    sim.load_config(scene)
    with pytest.raises(RuntimeError, match=f"{method[0]}: .*initialize"):
        getattr(sim, method[0])(*method[1:])


def test_no_scene_and_no_device():
    with pytest.raises(RuntimeError, match="load_config"):
        flash_sim.RealtimeSim().initialize()
    for device in ("cuda:99", "cuda:-1", "cuda:x", "gpu", "", "cuda:0,0", None, 3):
        with pytest.raises((ValueError, TypeError), match="^device") as raised:
            flash_sim.RealtimeSim(device=device)
        assert "--" not in str(raised.value) and "\n" not in str(raised.value)


def test_end_effectors_are_added_where_the_steps_are_counted_on_a_device(sim, monkeypatch):
    """Arrays of a device have none of numpy's methods."""
    for steps in (0, 2):
        count = np.full(sim.n_envs, float(steps))
        monkeypatch.setattr(sim, "status", lambda count=count: {"steps": DeviceArray(lambda: count, count.copy)})
        if steps:
            with pytest.raises(ValueError, match="add_ee: found 2 steps taken"):
                sim.add_ee("late", [0, 0, 1])
        else:
            sim.add_ee("first", [0, 0, 1])


def test_end_effectors_come_before_the_first_step(sim):
    sim.step()
    for steps in (1, 2):
        with pytest.raises(ValueError, match=f"add_ee: found {steps} steps taken .* before the first step of all environments"):
            sim.add_ee("late", [0, 0, 1])
        sim.step()
    sim.reset([0, 2])
    with pytest.raises(ValueError, match="add_ee: found 3 steps taken"):
        sim.add_ee("late", [0, 0, 1])
    sim.reset()
    sim.add_ee("late", [0, 0, 1])
    assert sim.end_effectors == ["hand", "late"]


def test_what_is_far_or_half_a_character_is_named(sim):
    for far, where in ([2e5, 0, 0], "2"), ([0, -1e300, 0], "-1e\\+300"):
        for call, words in ((sim.move_ee, ["hand"]), (sim.add_ee, ["new"])):
            with pytest.raises(ValueError, match=f"^{call.__name__}: [a-z_]*pose: found {where}[^ ]* m in row 0, expected at most"):
                call(*words, far)
    with pytest.raises(ValueError, match="^Asset: path: found .*half of a character"):
        flash_sim.Asset("a\ud800.json")
    with pytest.raises(ValueError, match="^load_config: path: found .*null character"):
        sim.load_config("scene.json\0.txt")
    with pytest.raises(ValueError, match="^add_ee: name: found .*half of a character"):
        sim.add_ee("\ud800", [0, 0, 1])


def test_wild_motions_crash_nothing(sim):
    """Jumps, spins and starts far away: whatever the status says, all numbers that are not lost are finite."""
    random = np.random.default_rng(7)
    for _ in range(15):
        turn = random.normal(size=(3, 4))
        sim.move_ee("hand", np.concatenate([random.uniform(-0.3, 0.3, (3, 3)),
                                            turn / np.linalg.norm(turn, axis=1)[:, None]], axis=1))
        sim.grasp_ee("hand", random.random(3) < 0.5)
        sim.step()
    sim.reset(0, positions=flash_sim.to_host(sim.positions())[:1] * 1e80)
    sim.set_velocities("towel", np.full((36, 3), 1e200), env_ids=1)
    sim.step(2)
    kept = flash_sim.to_host(sim.status())["lost"] == 0
    assert kept[2] and np.isfinite(flash_sim.to_host(sim.positions())[kept]).all()
    sim.reset()
    sim.step()
    assert (flash_sim.to_host(sim.status())["lost"] == 0).all()


def test_names_of_several_bodies_are_asked_for(tmp_path):
    sim = start(write_scene(tmp_path, objects={
        "a": "towel.json", "b": {"asset": "towel.json", "start": {"T_base_object": [0.3, 0, 0, 0, 0, 0, 1]}}}), 2)
    for call in (sim.positions, sim.velocities, sim.material, sim.triangles):
        with pytest.raises((ValueError, TypeError)):
            call()
    with pytest.raises((ValueError, TypeError), match="name of a body"):
        sim.reset(positions=np.zeros((2, 36, 3)))
    raised = sim.positions("b") + [0, 0, 1.0]
    sim.reset(positions={"b": raised})
    assert np.array_equal(sim.positions("b"), raised) and (sim.positions("a")[..., 2] == 0).all()
