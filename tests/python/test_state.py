"""Arrays that show the state, and what sets it."""
import gc
import os
import signal
import threading
import time

import numpy as np
import pytest
from conftest import start, write_scene

from flash_sim import to_host


def height(k):
    """Of the hand at step k: down onto the towel, there, up with it [m]."""
    return 0.05 - 0.0039 * k if k <= 10 else 0.011 + 0.004 * max(0, k - 12)


def lift(sim, first=0, last=24, shift=0.0):
    """Takes the corner and lifts it."""
    for k in range(first, last):
        poses = np.array([[0.2 - 0.001 * e - shift, 0.2, height(k)] for e in range(sim.n_envs)])
        sim.move_ee("hand", poses)
        sim.grasp_ee("hand", k >= 12)
        sim.step()


def everything(sim):
    return [to_host(a) for a in (sim.positions(), sim.velocities(), sim.force("hand"), sim.pose("hand"))]


def same(a, b):
    return all(np.array_equal(x, y) for x, y in zip(a, b))


@pytest.fixture
def hand(scene):
    """Three environments on the processor."""
    sim = start(scene, 3)
    sim.add_ee("hand", [0.2, 0.2, 0.05], size=[0.06, 0.06, 0.02], reach=0.002)
    return sim


def test_views_are_live_and_read_only(hand):
    sim = hand
    x, v, f, s = sim.positions(), sim.velocities(), sim.force("hand"), sim.status()
    assert x.shape == (3, 36, 3) and v.shape == (3, 36, 3) and f.shape == (3, 3) and s.shape == (3,)
    before = x.copy()
    lift(sim)
    assert not np.array_equal(x, before) and np.array_equal(x, sim.positions())
    assert np.shares_memory(x, sim.positions()) and np.shares_memory(f, sim.force("hand"))
    assert (s["steps"] == 24).all() and s["time"] == pytest.approx(0.24) and (s["converged"] == 1).all()
    assert (f[:, 2] > 0).all()  # the hand carries some of the towel
    for array in (x, v, f, s):
        with pytest.raises(ValueError):
            array[...] = 0
    assert np.array_equal(np.from_dlpack(x), x)


def test_old_views_keep_their_numbers(hand):
    sim = hand
    x, s = sim.positions(), sim.status()
    sim.step()
    numbers = x.copy()
    sim.initialize()
    sim.step(3)
    gc.collect()
    assert np.array_equal(x, numbers) and (s["steps"] == 1).all()
    y = sim.positions()
    sim.close()
    gc.collect()
    assert np.isfinite(y).all()


def test_views_stay_when_an_end_effector_is_added(sim):
    """Also those of a device, which takes its memory anew then."""
    x, f = sim.positions(), sim.force("hand")
    sim.add_ee("other", [0, 0, 0.05])
    lift(sim)
    assert np.array_equal(to_host(x), to_host(sim.positions())) and np.array_equal(to_host(f), to_host(sim.force("hand")))
    assert to_host(f).any() and to_host(x)[..., 2].max() > 0.01


def test_an_environment_is_the_same_alone(scene, device):
    def hand(sim, shift):
        start_poses = [[0.2 - 0.001 * e - shift, 0.2, height(0)] for e in range(sim.n_envs)]
        sim.add_ee("hand", start_poses, size=[0.06, 0.06, 0.02], reach=0.002)
        return sim
    for threads in (1, 2):
        many = hand(start(scene, 3, device, threads=threads), 0)
        lift(many)
        assert (many.held("hand") > 0).all()
        for e in range(3):
            alone = hand(start(scene, 1, device), 0.001 * e)
            lift(alone, shift=0.001 * e)
            assert same([a[0] for a in everything(alone)], [a[e] for a in everything(many)])


def test_steps_at_once_are_steps_one_by_one(scene, device):
    one, other = start(scene, 2, device), start(scene, 2, device)
    one.step(7)
    for _ in range(7):
        other.step()
    assert np.array_equal(to_host(one.positions()), to_host(other.positions()))


def test_a_place_alone_keeps_the_turn(sim):
    turn = [0, 0, np.sin(0.3), np.cos(0.3)]
    sim.move_ee("hand", [0.2, 0.2, 0.06, *turn])
    sim.move_ee("hand", [0.2, 0.2, 0.07], env_ids=[2, 0])
    assert np.array_equal(sim.pose("hand")[:, 3:], np.tile(turn, (3, 1)))
    assert sim.pose("hand")[:, 2].tolist() == [0.07, 0.06, 0.07]


def test_a_reset_is_a_new_start(sim):
    lift(sim)
    first = everything(sim)
    sim.reset(env_ids=[True, False, False])
    assert to_host(sim.status())["steps"].tolist() == [0, 24, 24]
    assert same([a[1:] for a in first], [a[1:] for a in everything(sim)])
    assert sim.held("hand")[0] == 0 and sim.pose("hand")[0, 2] == 0.05
    sim.reset()
    lift(sim)
    assert same(first, everything(sim))


def test_positions_and_velocities_are_set(sim):
    raised = to_host(sim.positions())[1:] + [0, 0, 0.3]
    sim.reset([2, 1], positions=raised[::-1])
    assert np.array_equal(to_host(sim.positions())[1:], raised) and not to_host(sim.velocities()).any()
    sim.set_velocities("towel", np.tile([0.0, 0, 1], (36, 1)), env_ids=1)
    sim.step()
    # Free flight by the implicit Euler method; solved to a thousandth of the weight.
    fallen = to_host(sim.positions())[1:, :, 2] - raised[..., 2]
    assert fallen[0] == pytest.approx(0.01 * (1 - 0.0981), abs=1e-6) and fallen[1] == pytest.approx(-0.000981, abs=1e-6)


def test_what_is_saved_goes_on_bitwise(sim):
    lift(sim, 0, 14)
    state = sim.save_state()
    part = sim.save_state(env_ids=[2])
    lift(sim, 14)
    end = everything(sim)
    sim.load_state(state)
    lift(sim, 14)
    assert same(end, everything(sim))
    sim.load_state(part, env_ids=[2])
    assert to_host(sim.status())["steps"].tolist() == [24, 24, 14]
    sim.initialize()
    with pytest.raises(ValueError, match="state"):
        sim.load_state(state)


def test_material_friction_and_gravity_of_each_environment(sim):
    sim.set_material("towel", bending_rigidity=[1e-5, 2e-5, 3e-5], friction=0.5)
    sim.set_material(areal_density=0.4, env_ids=1)
    material = sim.material()
    assert material["bending_rigidity"].tolist() == [1e-5, 2e-5, 3e-5] and (material["friction"] == 0.5).all()
    assert material["areal_density"].tolist() == [0.2, 0.4, 0.2]
    sim.set_gravity([[0, 0, -9.81], [1, 0, -9.81], [4, 0, -9.81]])
    sim.set_friction("towel", "table", [0.2, 0.2, 0.2])
    sim.step(20)
    moved = (to_host(sim.positions()) - start_positions(sim))[..., 0].mean(axis=1)
    # A Coulomb block: it sticks at 1 / 9.81 < 0.2 and slides at 4 / 9.81; implicit Euler adds half a step of speed.
    assert abs(moved[1]) < 1e-3
    assert moved[2] == pytest.approx(0.5 * (4 - 0.2 * 9.81) * 0.2 * 0.21, rel=0.02)


def start_positions(sim):
    state = sim.save_state()
    now = to_host(sim.positions())
    sim.reset()
    start = to_host(sim.positions())
    sim.load_state(state)
    assert np.array_equal(now, to_host(sim.positions()))
    return start


def test_a_table_bears_the_weight(sim):
    """m g, with the signs of a force on the bodies; solved to a thousandth of it."""
    table = sim.force("table")
    sim.step(20)
    assert to_host(table) == pytest.approx(np.tile([0, 0, 0.2 * 0.2 * 0.2 * 9.81], (3, 1)), abs=1e-3 * 0.0785)
    sim.reset()
    assert not to_host(table).any()


def test_a_lost_environment_says_why(tmp_path):
    path = write_scene(tmp_path, self_contact={"thickness": 0.001})
    sim = start(path, 2)
    through = sim.positions()[0].copy()
    through[:, 0] = np.abs(through[:, 0] - 0.1)  # folded onto itself
    sim.reset(1, positions=through[None])
    sim.step(3)
    assert sim.status()["lost"][0] == 0 and sim.status()["lost"][1] > 0
    assert sim.why_lost()[0] == "" and "layers in one place" in sim.why_lost()[1]
    sim.reset(1)
    sim.step()
    assert (sim.status()["lost"] == 0).all()


def test_ctrl_c_ends_a_step(sim):
    lift(sim, 0, 5)
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # which jobs in the background are without
    try:
        timer.start()
        with pytest.raises(KeyboardInterrupt):
            sim.step(10**9)
        timer.join()
    finally:
        signal.signal(signal.SIGINT, before)
    with pytest.raises(ValueError, match="interrupted"):
        sim.step()
    sim.reset()
    lift(sim)
    assert (to_host(sim.status())["steps"] == 24).all()


def test_a_handler_that_throws_nothing_lets_the_step_end(scene):
    """Of a script that wants to save before it ends."""
    seen = []
    before = signal.signal(signal.SIGINT, lambda *_: seen.append(True))
    try:
        sim = start(scene, 8)
        timer = threading.Timer(0.05, os.kill, (os.getpid(), signal.SIGINT))
        timer.start()
        sim.step(400)
        timer.join()
        time.sleep(0)
    finally:
        signal.signal(signal.SIGINT, before)
    assert seen and (sim.status()["steps"] == 400).all()


def test_other_threads_run_during_a_step_and_may_not_call(sim):
    counted, refused, done = [0], [], threading.Event()

    def count():
        while not done.is_set():
            counted[0] += 1
            try:
                sim.positions()
            except RuntimeError as error:
                refused.append(str(error))
            time.sleep(1e-4)

    thread = threading.Thread(target=count)
    thread.start()
    try:
        for _ in range(50):
            try:
                sim.step(10)
            except RuntimeError:
                pass
    finally:
        done.set()
        thread.join()
    assert counted[0] > 10 and refused and "another thread" in refused[0]
