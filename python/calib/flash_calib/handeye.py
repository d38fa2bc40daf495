"""Hand-eye calibration of arrays."""
import collections.abc
import json

import numpy as np
from numpy.typing import ArrayLike

from flash_calib import _core, arguments
from flash_calib.cameras import Camera, checked
from flash_calib.results import Calibration, calibration_of

SETUPS = ("eye-in-hand", "eye-to-hand")
LARGEST_PIXEL = 1e6  # of a corner [px]
Height = float | tuple[float, float]


def handeye_pairs(setup: str, T_base_gripper: ArrayLike, T_camera_target: ArrayLike, *, lens: str = "near", target_size: str | None = None,
                  target_size_sd: float | None = None, camera_height: Height | None = None, target_height: Height | None = None,
                  held_out_seed: int = 0, threads: int = 0) -> Calibration:
    """Where the camera is, from pairs of poses: what flash-calib handeye says of the same pairs.

    setup: "eye-in-hand", the camera rides on the gripper and the target stands still; or "eye-to-hand", the camera stands still and
    the gripper holds the target. Something that a tracker follows is a target too.
    T_base_gripper, T_camera_target: N poses each, of the same moments, as (N, 4, 4), (N, 3, 4) or (N, 7), x y z qx qy qz qw [m].
    Four are the least; 12 and more are better, that tilt by 20 to 40 degrees about two axes.

    lens: of the camera whose poses T_camera_target are. "near": its focal length is known to 0.5 %, and solved for; "stated": exact;
    "solved": nothing is known of it. Poses of a tracker, which stand off its axis, have none.
    target_size: "stated" keeps the size of the target as the poses have it, "solved" says that nobody knows it; None: it is known to
    target_size_sd, one standard deviation as a share of it (0: exactly; None: 1 %).
    camera_height, target_height: of a robot that turns about one axis alone, where camera or target is along that axis: metres, or
    metres and their deviation; of the camera in the frame that T is in, of the target in the other one.
    held_out_seed: draws the parts that are left out in turn; 0: interleaved. threads: 0: one a processor; no number depends on it.

    ValueError, in one line, names an argument that is wrong, or why these poses have no answer. An answer that must not be used has
    usable=False. Other threads of Python run meanwhile.
    """
    what = "handeye_pairs"
    arguments.one_of(f"{what}: setup", setup, SETUPS)
    robot = arguments.poses(f"{what}: T_base_gripper", T_base_gripper)
    target = arguments.poses(f"{what}: T_camera_target", T_camera_target)
    if len(robot) != len(target):
        raise ValueError(f"{what}: T_camera_target: found {len(target)} poses, expected {len(robot)}, as of T_base_gripper")
    arguments.one_of(f"{what}: lens", lens, ("near", "stated", "solved"))
    settings = _settings(what, target_size, target_size_sd, camera_height, target_height, held_out_seed, threads)
    settings.set_lens(lens)
    return _solved(what, _core.handeye_pairs, setup, robot, target, settings)


def handeye_corners(setup: str, T_base_gripper: ArrayLike, corners: collections.abc.Sequence[ArrayLike | None],
                    points: ArrayLike | str, camera: Camera, *, any_end: bool = False, use: str = "workspace", lens: str = "near",
                    target_size: str | None = None, target_size_sd: float | None = None, camera_height: Height | None = None,
                    target_height: Height | None = None, held_out_seed: int = 0, threads: int = 0) -> Calibration:
    """Where the camera is, from corners of a target in pictures: what flash-calib handeye says of pictures with such corners.

    Errors in variables: the noise of robot and corners, lens, size and warp of the target are solved for beside the transform.

    setup, T_base_gripper, target_size, heights, held_out_seed, threads: as of handeye_pairs.
    corners: of each of the N views (M, 2), where the points were seen [px], in the order of the points; NaN in both columns for a point
    that was not seen, None for a view without any. Pixel centres are whole numbers, as OpenCV has them.
    points: (M, 3) of the flat target, z = 0 [m]. Or a target in words, as "charuco:7x5:0.04:0.03:DICT_5X5_100", whose points and order
    target_points gives. Of markers and tags words are better: pictures show their edges moved, which words let the answer solve for.
    camera: the lens as it is stated. Its covariance, if there is one, says how well that is known; else 0.5 %.
    any_end: the corners of some views may begin at another end of the grid, as those of a plain chessboard may; of words this is known.
    use: "workspace", for places seen by the camera; "image", for places in the picture through this robot; "two-arms", for arms that
    one camera relates. lens: "near" to what is stated, "stated" to the last digit, or "solved": nothing is known.

    ValueError and usable as of handeye_pairs.
    """
    what = "handeye_corners"
    arguments.one_of(f"{what}: setup", setup, SETUPS)
    arguments.one_of(f"{what}: use", use, ("workspace", "image", "two-arms"))
    arguments.one_of(f"{what}: lens", lens, ("near", "stated", "solved"))
    any_end = arguments.truth(f"{what}: any_end", any_end)
    robot = arguments.poses(f"{what}: T_base_gripper", T_base_gripper)
    if isinstance(points, str):
        words, places = points, target_points(points)
    else:
        words, places = "", _points(f"{what}: points", points)
    pixels = _pixels(f"{what}: corners", corners, len(robot), len(places))
    values, covariance = checked(f"{what}: camera", camera)
    settings = _settings(what, target_size, target_size_sd, camera_height, target_height, held_out_seed, threads)
    settings.set_use(use)
    settings.set_lens(lens)
    if covariance is not None:
        settings.set_lens_covariance(covariance)
    return _solved(what, _core.handeye_corners, setup, robot, pixels, places, words, any_end, values, settings)


def target_points(target: str) -> np.ndarray:
    """(M, 3) points of a target in words [m], as "chessboard:9x6:0.025", in the order of corners; docs/calibration.md has all kinds."""
    try:
        return _core.target_points(arguments.text("target_points: target", target))
    except ValueError as error:
        raise ValueError(str(error) if str(error).startswith("target_points") else f"target_points: {error}") from None


def _solved(what, solve, *given):
    try:
        found = solve(*given)
    except (ValueError, RuntimeError) as error:
        line = arguments.as_arguments(str(error))
        raise ValueError(line if line.startswith(what) else f"{what}: {line}") from None
    return calibration_of(found, json.loads(found["text"]))


def _settings(what, target_size, target_size_sd, camera_height, target_height, held_out_seed, threads):
    settings = _core.Settings()
    if target_size_sd is not None:
        settings.target_size_sd = arguments.number(f"{what}: target_size_sd", target_size_sd, 0, 1)
    if target_size is not None and arguments.one_of(f"{what}: target_size", target_size, ("stated", "solved")) == "stated":
        settings.size_as_stated = True
    elif target_size is not None:
        if target_size_sd is not None:
            raise ValueError(f"{what}: target_size, target_size_sd: found 'solved' and {arguments.kind(target_size_sd)}, expected one of both")
        settings.target_size_sd = float("inf")
    if camera_height is not None and target_height is not None:
        raise ValueError(f"{what}: camera_height, target_height: found both, expected one")
    for name, height in (("camera_height", camera_height), ("target_height", target_height)):
        if height is not None:
            settings.set_height(name == "target_height", *_height(f"{what}: {name}", height))
    settings.held_out_seed = arguments.whole_number(f"{what}: held_out_seed", held_out_seed, 0, 1_000_000_000)
    settings.threads = arguments.whole_number(f"{what}: threads", threads, 0, 1024)
    return settings


def _height(what, value):
    """Metres and their deviation."""
    height = arguments.numbers(what, value, (), (2,)).reshape(-1)
    sd = height[1] if len(height) == 2 else 1e-3
    if not abs(height[0]) < 10 or not 0 < sd < 10:
        raise ValueError(f"{what}: found {arguments.kind(value)}, expected metres below 10, and their deviation above 0, as (0.35, 0.002)")
    return height[0], sd


def _points(what, value):
    points = arguments.numbers(what, value, (None, 3))
    if len(points) < 4:
        raise ValueError(f"{what}: found {len(points)} points, expected 4 or more")
    size = np.linalg.norm(points - points.mean(axis=0), axis=1).max()
    if not 1e-4 < size < 10:
        raise ValueError(f"{what}: found points {size:.6g} m from their middle, expected metres")
    if np.abs(points[:, 2]).max() > 1e-9 * size:
        raise ValueError(f"{what}: found z up to {np.abs(points[:, 2]).max():.6g} m, expected a flat target, z = 0")
    if np.linalg.svd(points[:, :2] - points[:, :2].mean(axis=0), compute_uv=False)[1] < 1e-3 * size:
        raise ValueError(f"{what}: found all points on one line, expected points of a plane")
    return points


def _pixels(what, corners, views, points):
    """(N, M, 2), NaN where nothing was seen."""
    listed = isinstance(corners, collections.abc.Sequence) and not isinstance(corners, str | bytes)
    if not listed and not (isinstance(corners, np.ndarray) and corners.ndim > 0):
        raise TypeError(f"{what}: found {arguments.kind(corners)}, expected an array a view")
    if len(corners) != views:
        raise ValueError(f"{what}: found {len(corners)} views, expected {views}, as of T_base_gripper")
    pixels = np.full((views, points, 2), np.nan)
    for i, seen in enumerate(corners):
        if seen is None:
            continue
        pixels[i] = arguments.numbers(f"{what}: view {i}", seen, (points, 2), unseen=True)
        half = np.isnan(pixels[i]).any(axis=1) & ~np.isnan(pixels[i]).all(axis=1)
        if half.any():
            raise ValueError(f"{what}: view {i}: found nan in one column of corner {np.argmax(half)}, expected both or neither")
        far = np.abs(pixels[i]) > LARGEST_PIXEL
        if far.any():
            raise ValueError(f"{what}: view {i}: found {pixels[i][far][0]:.6g} px, expected at most {LARGEST_PIXEL:.0f}")
    return pixels
