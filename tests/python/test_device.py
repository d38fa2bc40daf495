"""Simulations on a CUDA device beside those of the processor, and their arrays in the hands of others."""
import ctypes

import numpy as np
import pytest
from conftest import start, write_scene
from test_state import lift

import flash_sim
from flash_sim import arguments, folds, to_host
from flash_sim.device_array import DeviceArray
from flash_sim.tasks import FoldSettings, FoldTask, FoldTeacher

TOLERANCE = 1e-6
SOLVED = {"type": "newton", "tolerance": TOLERANCE}


@pytest.fixture
def cuda():
    """Skips where there is no device."""
    try:
        flash_sim.RealtimeSim("cuda")
    except ValueError as error:
        pytest.skip(str(error))


def handed(path, device, n_envs=3):
    sim = start(path, n_envs, device)
    sim.add_ee("hand", [0.2, 0.2, 0.05], size=[0.06, 0.06, 0.02], reach=0.002)
    return sim


def views(sim):
    return sim.positions(), sim.velocities(), sim.force("hand"), sim.force("table"), sim.status(), sim.status()["lost"]


def read_memory(array):
    """What stands where __cuda_array_interface__ says, by the driver alone."""
    seen = array.__cuda_array_interface__
    assert seen["version"] == 3 and seen["typestr"] == "<f8" and seen["data"][1] is True
    strides = seen["strides"]
    driver = ctypes.CDLL("libcuda.so.1")
    context = ctypes.c_void_p()
    assert driver.cuCtxGetCurrent(ctypes.byref(context)) == 0 and context.value
    span = sum((length - 1) * step for length, step in zip(seen["shape"], strides)) // 8 + 1
    numbers = np.empty(span)
    copied = driver.cuMemcpyDtoH_v2(ctypes.c_void_p(numbers.ctypes.data), ctypes.c_uint64(seen["data"][0]),
                                    ctypes.c_size_t(numbers.nbytes))
    assert copied == 0
    return np.lib.stride_tricks.as_strided(numbers, seen["shape"], strides)


def test_a_lift_is_that_of_the_processor(tmp_path, cuda):
    """To the tolerance times g t^2, and five times that where a vertex sticks on one and slides on the other."""
    path = write_scene(tmp_path, solver=SOLVED)
    here, there = handed(path, "cpu"), handed(path, "cuda")
    assert there.device == "cuda:0" and here.device == "cpu"
    for sim in (here, there):
        lift(sim)
    assert (here.held("hand") == there.held("hand")).all() and (here.held("hand") > 0).all()
    near = 5 * TOLERANCE * 9.81 * 0.24**2
    assert np.abs(to_host(here.positions()) - to_host(there.positions())).max() <= near
    assert np.abs(to_host(here.velocities()) - to_host(there.velocities())).max() <= 2 * near / 0.01
    weight = 0.2**3 * 9.81
    for name in ("hand", "table"):
        assert np.abs(to_host(here.force(name)) - to_host(there.force(name))).max() <= 1e-2 * weight
    for name in ("steps", "converged", "lost"):
        assert (to_host(here.status())[name] == to_host(there.status()[name])).all()


def test_views_follow_the_steps(scene, cuda):
    sim = handed(scene, "cuda")
    seen = views(sim)
    assert [view.shape for view in seen] == [(3, 36, 3), (3, 36, 3), (3, 3), (3, 3), (3, 7), (3,)]
    places = [view.__cuda_array_interface__["data"] for view in seen]
    before = [to_host(view) for view in seen[:5]]
    lift(sim)
    assert all((to_host(view) != old).any() for view, old in zip(seen, before))
    sim.reset([1])
    for view, place in zip(seen, places):
        assert view.__cuda_array_interface__["data"] == place and isinstance(view, DeviceArray)
        shown = view.numpy() if view is not seen[4] else np.stack([view.numpy()[name] for name in view.numpy().dtype.names], axis=1)
        assert np.array_equal(read_memory(view), shown)
    assert to_host(seen[4])["steps"].tolist() == [24, 0, 24]


def test_memory_in_the_hands_of_others_stays(scene, cuda):
    """Through a new end effector, a new start, and the end of the simulation."""
    sim = start(scene, 3, "cuda")
    x = sim.positions()
    place = x.__cuda_array_interface__["data"]
    capsule = x.__dlpack__()
    sim.add_ee("hand", [0.2, 0.2, 0.05], size=[0.06, 0.06, 0.02], reach=0.002)
    assert x.__cuda_array_interface__["data"] == place
    lift(sim)
    last = x.numpy()
    assert np.array_equal(read_memory(x), last) and last[..., 2].max() > 0.01
    sim.initialize()
    sim.step(3)
    sim.close()
    assert np.array_equal(flash_sim._core.to_host(capsule), last)


def test_views_of_what_is_gone_are_exceptions(scene, cuda):
    sim = handed(scene, "cuda")
    for end in (sim.initialize, sim.close):
        seen = [sim.positions(), sim.velocities(), sim.force("table"), sim.status(), sim.status()["time"]]
        end()
        for view in seen:
            for use in (view.numpy, view.__dlpack__, view.__dlpack_device__, lambda v=view: v.__cuda_array_interface__,
                        lambda v=view: to_host(v), lambda v=view: arguments.numbers("x", v)):
                with pytest.raises((RuntimeError, TypeError), match="closed or initialized anew"):
                    use()


def test_numpy_takes_copies_alone(scene, cuda):
    sim = handed(scene, "cuda")
    x = sim.positions()
    for take in (np.asarray, np.array, lambda view: view + np.zeros(3)):
        with pytest.raises(TypeError, match=r"found an array on cuda:0, expected .*numpy\(\)"):
            take(x)
    assert x.__dlpack_device__() == (2, 0) and len(x) == 3 and x.ndim == 3 and "cuda:0" in repr(x)
    assert np.array_equal(np.from_dlpack(x, device="cpu"), to_host(x))
    for stream in (None, -1, 1, 2, 2**40):
        x.__dlpack__(stream=stream, max_version=(1, 0))
    for stream in (0, -2, "a", True):
        with pytest.raises(ValueError, match="stream: found"):
            x.__dlpack__(stream=stream)
    with pytest.raises(KeyError, match="status: found 'foot'"):
        sim.status()["foot"]


def test_what_is_given_may_be_on_a_device(scene, cuda):
    sim, other = handed(scene, "cuda"), handed(scene, "cuda")
    lift(sim)
    other.reset(positions=sim.positions(), velocities=sim.velocities())
    for a, b in zip((sim.positions(), sim.velocities()), (other.positions(), other.velocities())):
        assert np.array_equal(to_host(a), to_host(b))
    with pytest.raises(ValueError, match="shape"):
        other.set_velocities("towel", sim.force("table"))


@pytest.mark.parametrize("library", ["torch", "cupy", "jax"])
def test_libraries_take_it_without_a_copy(library, scene, cuda):
    pytest.importorskip(library)
    sim = handed(scene, "cuda")
    if library == "torch":
        import torch
        if not torch.cuda.is_available():
            pytest.skip("torch has no CUDA device")
        taken = torch.from_dlpack(sim.positions())
        lift(sim)
        assert taken.data_ptr() == sim.positions().__cuda_array_interface__["data"][0]
        with torch.cuda.stream(torch.cuda.Stream()):
            poses = torch.zeros(3, 7, dtype=torch.float64, device="cuda")
            poses[:, 2], poses[:, 6] = taken[:, :, 2].max(dim=1).values, 1
            sim.move_ee("hand", poses)
        assert np.allclose(sim.pose("hand")[:, 2], to_host(sim.positions())[..., 2].max(axis=1))
        sim.reset(torch.tensor([True, False, True], device="cuda"))
        assert to_host(sim.status()["steps"]).tolist() == [0, 24, 0]
        assert np.array_equal(taken.cpu().numpy(), to_host(sim.positions()))
        return
    if library == "jax":
        import jax
        jax.config.update("jax_enable_x64", True)
        taken = jax.dlpack.from_dlpack(sim.positions())  # of which jax believes that it does not change
    else:
        import cupy
        taken = cupy.from_dlpack(sim.positions())
        lift(sim)
    assert np.array_equal(to_host(taken), to_host(sim.positions()))


def test_what_a_device_cannot_do_is_refused_by_name_and_auto_goes_without(tmp_path, cuda):
    path = write_scene(tmp_path, self_contact={"thickness": 0.001})
    with pytest.raises(ValueError, match=r"scene.json: device cuda: .*self-contact") as refused:
        start(path, 2, "cuda")
    assert "\n" not in str(refused.value) and "--" not in str(refused.value)
    sim = start(path, 2, "auto")
    sim.step()
    assert sim.device == "cpu" and any("self-contact" in notice for notice in sim.notices)


def test_auto_takes_what_is_there(scene):
    sim = start(scene, 2, "auto")
    try:
        flash_sim.RealtimeSim("cuda")
        assert sim.device == "cuda:0"
    except ValueError:
        assert sim.device == "cpu" and not any("device" in notice for notice in sim.notices)


def test_a_closed_simulation_asks_for_initialize(sim):
    sim.close()
    sim.close()
    with pytest.raises(RuntimeError, match="step: .*initialize"):
        sim.step()
    sim.initialize()
    sim.step()
    assert (to_host(sim.status()["steps"]) == 1).all()


def test_arrays_of_the_processor_go_round(device, scene):
    """Numbers of all kinds, strided and turned around, as they are."""
    numbers = np.arange(24.0).reshape(2, 3, 4)
    for array in (numbers, numbers[:, ::2, ::-1], numbers[1:0], np.float32(numbers).T, numbers > 3, np.int32(numbers)[0, 0],
                  np.array(2.5)):
        back = flash_sim._core.to_host(array)
        assert back.dtype == array.dtype and np.array_equal(back, array)
        assert np.array_equal(to_host(array), array) and not np.shares_memory(to_host(array), array)


@pytest.fixture
def plain_fold():
    """The towel's, whose layers pass through each other: a device has no self-contact."""
    return folds.Fold(folds.FOLDS["lift"].scene, folds.FOLDS["towel"].stages)


@pytest.mark.parametrize("name", ("plain", "lift"))
def test_the_teacher_folds_and_lifts_a_towel_on_each_device(plain_fold, device, name):
    fold = plain_fold if name == "plain" else name
    task = FoldTask(4, FoldSettings(fold, randomization="published", seed=5), device=device)
    assert task.sim.device.startswith(device)
    teacher, done = FoldTeacher(task), np.zeros(4, bool)
    for _ in range(task.time_limit):
        observations, _, success, _ = task.step(teacher.act(task))
        assert isinstance(observations, np.ndarray)
        done |= success
        if done.all():
            break
    assert done.all()


def test_episodes_of_gymnasium_on_each_device(plain_fold, device):
    pytest.importorskip("gymnasium")
    from flash_sim.gym import FoldVectorEnv
    env = FoldVectorEnv(3, FoldSettings(plain_fold, steps_per_action=1, time_limit=2), device=device)
    observations, _ = env.reset(seed=3)
    for step in range(2):
        observations, rewards, terminated, truncated, infos = env.step(np.zeros((3, 4)))
    assert truncated.all() and (infos["final_obs"] != observations).any() and np.isfinite(rewards).all()
    assert (to_host(env.task.sim.status()["steps"]) == 0).all()


def test_episodes_of_rsl_rl_on_each_device(plain_fold, device):
    torch = pytest.importorskip("torch")
    pytest.importorskip("rsl_rl")
    from flash_sim.rsl import FoldVecEnv
    tensors = "cuda" if device == "cuda" and torch.cuda.is_available() else "cpu"
    env = FoldVecEnv(2, FoldSettings(plain_fold, steps_per_action=1, time_limit=3), device=tensors, sim_device=device)
    observations, rewards, dones, _ = env.step(torch.zeros(2, 4, device=tensors))
    assert observations["policy"].device.type == rewards.device.type == tensors and dones.tolist() == [0, 0]


def test_folds_with_self_contact_are_refused_on_a_device(cuda):
    with pytest.raises(ValueError, match="self-contact"):
        FoldTask(1, device="cuda")
    assert FoldTask(1).sim.device == "cpu"


def seen(path, device):
    sim = handed(path, device)
    sim.add_camera("top", 64, 48, fx=60.0, fy=60.0, cx=31.5, cy=23.5, pose=flash_sim.look_at((0.1, 0.1, 0.6), (0.1, 0.1, 0)))
    sim.add_camera("hand", 32, 24, fx=30.0, fy=30.0, cx=15.5, cy=11.5, pose=[0, 0, 0, 1, 0, 0, 0], carrier="hand")
    return sim


PICTURES = ("depth", "distance", "instance", "triangle", "points")


def test_pictures_are_those_of_the_processor(tmp_path, cuda):
    """Drawn where the state is. To where the sheets are: those of a device and of the processor differ by the tolerance."""
    path = write_scene(tmp_path, solver=SOLVED)
    here, there = seen(path, "cpu"), seen(path, "cuda")
    for steps in (0, 20):
        for sim in (here, there):
            if steps:
                lift(sim)
        for camera in ("top", "hand"):
            own, other = here.render(camera, PICTURES), there.render(camera, PICTURES)
            if not steps:  # the same places
                assert all(np.array_equal(own[name], other[name]) for name in PICTURES)
            alike = own["triangle"] == other["triangle"]
            assert alike.mean() > 0.99 and (own["instance"] == other["instance"]).mean() > 0.995
            for name in ("depth", "distance"):
                assert np.abs(own[name] - other[name])[alike].max() < 1e-4
    there.reset(positions=to_host(here.positions()))
    here.reset(positions=to_host(here.positions()))
    for name, picture in here.render("top", PICTURES).items():
        assert np.array_equal(picture, there.render("top", PICTURES)[name])
    some = there.render("top", PICTURES, env_ids=[2, 0])
    assert all(np.array_equal(some[name], there.render("top", PICTURES)[name][[2, 0]]) for name in PICTURES)


def test_pictures_are_written_to_arrays_of_the_device(scene, cuda):
    torch = pytest.importorskip("torch")
    sim = seen(scene, "cuda")
    lift(sim)
    kinds = {"depth": torch.float32, "distance": torch.float32, "instance": torch.uint8, "triangle": torch.int32, "points": torch.float32}
    out = {name: torch.full((3, 48, 64) + ((3,) if name == "points" else ()), 77, dtype=kind, device="cuda") for name, kind in kinds.items()}
    drawn = sim.render("top", out=out)
    for name, picture in sim.render("top", PICTURES).items():
        assert drawn[name] is out[name] and np.array_equal(picture, out[name].cpu().numpy())
    before = {name: array.clone() for name, array in out.items()}
    shape = (3, 48, 64)
    for bad in ({"depth": torch.zeros(shape, dtype=torch.float64, device="cuda")}, {"depth": torch.zeros(shape[1:], device="cuda")},
                {"depth": torch.zeros(3, 64, 48, device="cuda").transpose(1, 2)}, {"depth": torch.zeros(shape)},
                {"depth": out["depth"], "instance": np.zeros(shape, np.uint8)}):
        with pytest.raises((ValueError, TypeError), match="render: out: .*found"):
            sim.render("top", out=bad)
    assert all(torch.equal(before[name], array) for name, array in out.items())
