"""Errors of depth cameras by their statistics, and against closed forms."""
import dataclasses

import numpy as np
import pytest

import flash_sim
from flash_sim import depth_noise
from flash_sim.depth_noise import DepthNoise, add_depth_noise, jitter_poses

NONE = DepthNoise(blockouts=0, jitter=0, flying=0, grazing=90, noise=0, robot_margin=0)
LENS = (300.0, 310.0, 79.3, 58.1)


def flat(count=4, depth=0.8, shape=(120, 160)):
    return np.full((count, *shape), depth, np.float32)


def disc(count=4, inside=0.5, outside=0.0, radius=40):
    v, u = np.mgrid[:120, :160]
    picture = np.where((u - 80) ** 2 + (v - 60) ** 2 < radius**2, inside, outside)
    return np.tile(picture.astype(np.float32), (count, 1, 1))


def random_of(seed):
    return np.random.default_rng(seed)


def test_without_errors_nothing_changes():
    assert np.array_equal(add_depth_noise(disc(), 1, NONE, lens=LENS), disc())


def test_a_seed_and_a_number_decide():
    pictures, robot = disc(6, 0.5, 0.9), disc(6, 0.3, 0, 10)
    first = add_depth_noise(pictures, 5, robot=robot, lens=LENS)
    assert np.array_equal(first, add_depth_noise(pictures, 5, robot=robot, lens=LENS))
    assert np.array_equal(first[:3], add_depth_noise(pictures[:3], 5, robot=robot[:3], lens=LENS))
    assert not np.array_equal(first, add_depth_noise(pictures, 6, robot=robot, lens=LENS))
    assert not np.array_equal(first[0], first[1])
    assert first.dtype == np.float32 and np.array_equal(pictures, disc(6, 0.5, 0.9))


def test_blockouts_are_as_many_and_as_large_as_stated():
    """An edge is even from 0 to a share s, so that one covers s^2/4 of the picture on average, and 0 to n are n/2."""
    count, share = 4000, 0.2
    settings = dataclasses.replace(NONE, blockouts=1, blockout_size=share)
    blocked = (add_depth_noise(flat(count), 3, settings) == 0).mean(axis=(1, 2))
    # Of one: the mean of x y is s^2/4, of its square s^4/9, in half of the pictures.
    mean, square = share**2 / 8, share**4 / 18
    assert abs(blocked.mean() - mean) < 5 * np.sqrt((square - mean**2) / count) + 0.02 * mean  # 2 %: whole pixels
    assert abs((blocked == 0).mean() - 0.5) < 0.04  # also those without a pixel
    many = (add_depth_noise(flat(500), 3, dataclasses.replace(settings, blockouts=4)) == 0).mean()
    assert many == pytest.approx(share**2 / 2, rel=0.15)


def test_blockouts_lie_anywhere():
    """Along an axis an edge e covers a place in the middle with the probability e / (1 - e), which over all e up to s is
    (-log(1 - s) - s) / s."""
    share = 0.3
    settings = dataclasses.replace(NONE, blockouts=6, blockout_size=share)
    covered = (add_depth_noise(flat(1500), 8, settings) == 0).mean(axis=0)
    of_one = ((-np.log(1 - share) - share) / share) ** 2
    expected = np.mean([1 - (1 - of_one) ** k for k in range(7)])
    # 4,500 rectangles, which cover 27 % of the middle each: 2 %; whole pixels: 2 %.
    assert covered[40:80, 50:110].mean() == pytest.approx(expected, rel=0.08)
    assert (covered.reshape(6, 20, 8, 20).mean(axis=(1, 3)) > 0).all()


def test_noise_has_its_deviation():
    settings = dataclasses.replace(NONE, noise=2e-3, noise_of_square=4e-3)
    for depth in (0.4, 1.5):
        error = add_depth_noise(flat(10, depth), 1, settings) - np.float64(np.float32(depth))
        expected = np.hypot(2e-3, 4e-3 * depth**2)
        # The deviation of n samples spreads by 1 / sqrt(2 n), the mean by 1 / sqrt(n).
        assert abs(error.std() / expected - 1) < 5 / np.sqrt(2 * error.size)
        assert abs(error.mean()) < 5 * expected / np.sqrt(error.size)
        assert (np.abs(error) < 2 * expected).mean() == pytest.approx(0.9545, abs=0.003)
    neighbours = error[:, :, 1:] * error[:, :, :-1]
    assert abs(neighbours.mean()) < 5 * expected**2 / np.sqrt(neighbours.size)  # each pixel by itself


def test_noise_makes_nothing_of_nothing():
    noisy = add_depth_noise(disc(), 1, dataclasses.replace(NONE, noise=0.3))
    assert (noisy[disc() == 0] == 0).all() and (noisy >= 0).all()


def test_steps_of_depth_grow_with_its_square():
    settings = dataclasses.replace(NONE, step_of_square=4e-3)
    depth = np.linspace(0.3, 3, 120 * 160, dtype=np.float32).reshape(1, 120, 160)
    stepped = add_depth_noise(depth, 1, settings).astype(float)
    assert np.abs(np.rint(1 / stepped / 4e-3) * 4e-3 * stepped - 1).max() < 1.2e-7
    # No farther than half a step of 1/z; over z^2 an even error of that width.
    error = 1 / stepped - 1 / depth.astype(float)
    assert np.abs(error).max() <= 2e-3 * (1 + 1e-4)
    assert error.std() == pytest.approx(4e-3 / np.sqrt(12), rel=0.02)
    far = np.diff(np.unique(stepped))
    assert far[-1] == pytest.approx(4e-3 * 3**2, rel=0.03) and far[0] == pytest.approx(4e-3 * 0.3**2, rel=0.03)


def test_boundaries_are_pixels_beside_a_jump():
    depth = disc(1, 0.5, 0.9)[0]
    found = depth_noise.boundaries(depth, 0.02)
    brute = np.zeros_like(found)
    for v in range(120):
        for u in range(160):
            for dv, du in ((0, 1), (1, 0), (0, -1), (-1, 0)):
                if 0 <= v + dv < 120 and 0 <= u + du < 160:
                    brute[v, u] |= depth[v, u] != depth[v + dv, u + du]
    assert np.array_equal(found, brute) and not depth_noise.boundaries(depth, 0.5).any()


def test_jitter_moves_boundaries_alone_and_by_its_deviation():
    edge = np.zeros((1, 2000, 60), np.float32)
    edge[:, :, 30:] = 0.7
    settings = dataclasses.replace(NONE, jitter=2.0)
    jittered = add_depth_noise(edge, 2, settings)[0] > 0
    assert np.array_equal(np.delete(jittered, (29, 30), axis=1), np.delete(edge[0] > 0, (29, 30), axis=1))
    # A pixel changes sides where a rounded step is 1 or more: with the probability of more than half a pixel, by 2.
    from math import erfc, sqrt
    share = 0.5 * erfc(0.5 / 2 / sqrt(2))
    changed = np.concatenate([jittered[:, 29], ~jittered[:, 30]])
    assert abs(changed.mean() - share) < 5 * np.sqrt(share * (1 - share) / len(changed))


def test_flying_pixels_lie_evenly_between_the_sides():
    edge = np.full((1, 4000, 6), 0.5, np.float32)
    edge[:, :, 3:] = 0.9
    flown = add_depth_noise(edge, 4, dataclasses.replace(NONE, flying=0.3))[0]
    between = (flown != edge[0])
    assert not between[:, [0, 1, 4, 5]].any()
    share = between[:, 2:4].mean()
    assert abs(share - 0.3) < 5 * np.sqrt(0.21 / 8000)
    places = (flown[between] - 0.5) / 0.4
    assert places.min() >= 0 and places.max() <= 1 and abs(places.mean() - 0.5) < 5 / np.sqrt(12 * len(places))
    assert places.std() == pytest.approx(1 / np.sqrt(12), rel=0.05)
    assert np.array_equal(add_depth_noise(disc(), 4, dataclasses.replace(NONE, flying=1)), disc())  # beside nothing none fly


def test_angles_of_a_plane_are_exact():
    """Of a plane n . x = d each ray has its own angle; 1/z loses 6e-8 as float32, over the slope of a pixel."""
    v, u = np.mgrid[:120, :160]
    fx, fy, cx, cy = LENS
    rays = np.stack([(u - cx) / fx, (v - cy) / fy, np.ones(u.shape)], axis=2)
    for normal in ([0.0, 0, 1], [0.6, 0, 0.8], [0.3, -0.9, 0.4]):
        normal = np.array(normal) / np.linalg.norm(normal)
        depth = 0.6 / (rays @ normal)
        expected = np.degrees(np.arccos(rays @ normal / np.linalg.norm(rays, axis=2)))
        seen = depth > 0
        assert np.abs(depth_noise.angles(np.where(seen, depth, 0), LENS) - expected)[seen].max() < 1e-5
        single = depth_noise.angles(np.where(seen, depth, 0).astype(np.float32), LENS)
        assert np.abs(single - expected)[seen].max() < 0.1


def test_grazing_surfaces_are_not_seen():
    v, u = np.mgrid[:120, :160]
    fx, fy, cx, cy = LENS
    slope = (v - cy) / fy + 0.25  # of a table below the camera; the ray meets it at this sine over its length
    depth = np.where(slope > 0.02, 0.5 / np.maximum(slope, 0.02), 0).astype(np.float32)[None]
    dropped = add_depth_noise(depth, 0, dataclasses.replace(NONE, grazing=75.0), lens=LENS)
    normal = np.array([0, 1, 0.25]) / np.hypot(1, 0.25)
    rays = np.stack([(u - cx) / fx, (v - cy) / fy, np.ones(u.shape)], axis=2)
    angle = np.degrees(np.arccos(rays @ normal / np.linalg.norm(rays, axis=2)))
    clear = (np.abs(angle - 75) > 0.1) & (depth[0] > 0)
    assert np.array_equal((dropped[0] > 0)[clear], (angle < 75)[clear]) and (dropped > 0).any() and (angle[clear] > 75).any()
    assert np.array_equal(add_depth_noise(depth, 0, dataclasses.replace(NONE, grazing=75.0)), depth)  # without a lens


def test_the_robot_hides_what_is_behind_it_and_a_margin_around():
    body, robot = disc(2, 0.6), np.zeros((2, 120, 160), np.float32)
    robot[:, 50:70, 70:90] = 0.4
    robot[1] = np.where(robot[1] > 0, np.float32(0.8), 0)  # behind the body
    hidden = add_depth_noise(body, 1, dataclasses.replace(NONE, robot_margin=3), robot=robot)
    expected = body[0].copy()
    expected[47:73, 67:93] = 0
    assert np.array_equal(hidden[0], expected) and np.array_equal(hidden[1], body[1])
    wide = add_depth_noise(body, 1, dataclasses.replace(NONE, robot_margin=500), robot=robot)
    assert not wide[0].any()


def test_poses_jitter_by_their_deviations():
    poses = flash_sim.look_at([0.4, -0.5, 0.6], np.tile([0.1, 0, 0], (20000, 1)))
    assert np.allclose(jitter_poses(poses, 1), poses, atol=1e-15)
    moved = jitter_poses(poses, 1, metres=0.01, degrees=2.0)
    assert np.array_equal(moved, jitter_poses(poses, 1, metres=0.01, degrees=2.0))
    assert not np.array_equal(moved, jitter_poses(poses, 2, metres=0.01, degrees=2.0))
    shift = moved[:, :3] - poses[:, :3]
    assert np.abs(shift.std(axis=0) / 0.01 - 1).max() < 5 / np.sqrt(2 * 20000)
    assert np.abs(shift.mean(axis=0)).max() < 5 * 0.01 / np.sqrt(20000)
    assert np.allclose(np.linalg.norm(moved[:, 3:], axis=1), 1)
    # The angle between both is the length of three Gaussian numbers: its square has the mean 3 s^2 and the deviation sqrt(6) s^2.
    angle = 2 * np.degrees(np.arccos(np.clip(np.abs((moved[:, 3:] * poses[:, 3:]).sum(axis=1)), 0, 1)))
    assert abs((angle**2).mean() - 12) < 5 * np.sqrt(6) * 4 / np.sqrt(20000)


@pytest.mark.parametrize("change", [{name: value} for name in ("blockouts", "robot_margin") for value in (-1, 0.5, "x", None)]
                         + [{name: value} for name in ("blockout_size", "jitter", "flying", "edge", "grazing", "noise",
                                                       "noise_of_square", "step_of_square") for value in (-1, float("nan"), "x")]
                         + [{"flying": 1.1}, {"blockout_size": 2}, {"grazing": 91}], ids=str)
def test_bad_sizes_are_refused_by_name(change):
    with pytest.raises((ValueError, TypeError), match=f"DepthNoise: {next(iter(change))}: found"):
        DepthNoise(**change)


def test_bad_pictures_are_refused_by_name():
    for what, arguments in (("depth", (disc().astype(float), 1)), ("depth", (disc()[0], 1)), ("depth", (-disc(), 1)),
                            ("depth", (disc() * np.float32(np.nan), 1)), ("depth", ("x", 1)), ("depth", (disc()[:, :0], 1)),
                            ("depth", (disc()[:, :, :0], 1)), ("robot", (disc(), 1, NONE, disc()[:, :0])), ("seed", (disc(), -1)),
                            ("seed", (disc(), 0.5)), ("settings", (disc(), 1, 3)), ("robot", (disc(), 1, NONE, disc(2))),
                            ("robot", (disc(), 1, NONE, 3)), ("lens", (disc(), 1, NONE, None, [1, 2]))):
        with pytest.raises((ValueError, TypeError), match=f"add_depth_noise: {what}: found"):
            add_depth_noise(*arguments)
    for what, arguments in (("poses", ([0] * 7, 1)), ("poses", (np.zeros((2, 7)), 1)), ("metres", (np.eye(7)[6:], 1, -1)),
                            ("degrees", (np.eye(7)[6:], 1, 0, "x")), ("seed", (np.eye(7)[6:], None))):
        with pytest.raises((ValueError, TypeError), match=f"jitter_poses: {what}: found"):
            jitter_poses(*arguments)


def test_no_pictures_stay_none():
    none = add_depth_noise(disc()[:0], 1, lens=[1, 1, 0, 0])
    assert none.shape == (0,) + disc().shape[1:] and none.dtype == np.float32
