"""Hand-eye calibration of arrays: the numbers are those of the program, and of the truth."""
import json
import os
import pathlib
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from calib_fixtures import CAMERA_NUMBERS, board, cell, off, pictures
from conftest import ROOT

import flash_calib
import flash_sim

BIN = pathlib.Path(sys.executable).parent
CHI_SQUARE_999 = 22.46  # six degrees of freedom
SETUPS = ("eye-in-hand", "eye-to-hand")
CAMERA = flash_calib.Camera(*CAMERA_NUMBERS)
# Of methods that stand beside the answer the program has OpenCV's too, and says where it read what.
OTHER = {"comparison", "provenance"}


def program(*words, code=0):
    done = subprocess.run([BIN / "flash-calib", *map(str, words)], capture_output=True, text=True)
    assert done.returncode == code, done.stderr
    return done.stdout


def without(summary, *names):
    return {name: value for name, value in summary.items() if name not in OTHER.union(names)}


def expect_truth(answer, X):
    error = off(answer.T, X)
    assert error @ np.linalg.solve(answer.covariance, error) < CHI_SQUARE_999, error


@pytest.mark.parametrize("setup", SETUPS)
@pytest.mark.parametrize("count", [5, 24])
def test_pairs_are_answered_as_by_the_program(setup, count, tmp_path):
    robot, target, X, Z = cell(setup, count)
    np.savez(tmp_path / "pairs.npz", robot=robot, target=target)
    said = json.loads(program("handeye", tmp_path / "pairs.npz", "--setup", setup, "--json", "--quiet", "--held-out-seed", 3))
    answer = flash_calib.handeye_pairs(setup, robot, target, held_out_seed=3)
    assert without(answer.summary) == without(said)  # to the last digit
    for name, method in answer.summary["comparison"].items():
        if name == "pose_space":
            assert method == said["comparison"][name]
    assert answer.T[:3, 3].tolist() == said["transform"]["translation"]
    assert answer.covariance.tolist() == said["covariance"] and answer.usable and answer.refusals == []
    assert answer.warnings == said["warnings"] and answer.used.tolist() == [view["used"] for view in said["views"]]
    assert answer.used.sum() >= 4 and [reason is None for reason in answer.reasons] == answer.used.tolist()
    assert 1e3 * answer.held_out.translation == pytest.approx(said["residuals"]["heldout_mm"], rel=1e-15)
    assert answer.held_out.corners is None and answer.lens is None and answer.size.estimate == said["scale"]["estimate"]
    R = answer.T[:3, :3]
    in_parent = np.concatenate([np.diag(R @ answer.covariance[:3, :3] @ R.T), np.diag(R @ answer.covariance[3:, 3:] @ R.T)])
    assert np.allclose(answer.sd**2, in_parent, rtol=1e-9)
    assert np.allclose(R @ R.T, np.eye(3), atol=1e-12) and answer.target_pose.shape == (4, 4)
    assert (np.linalg.eigvalsh(answer.covariance - answer.repeatable) > -1e-12).all()
    expect_truth(answer, X)
    assert np.allclose(answer.target_pose[:3, 3], Z[:3, 3], atol=5e-3)
    assert (answer.parent, answer.child) == ("gripper" if setup == "eye-in-hand" else "base", "camera")
    assert f"{answer.used.sum()} of {count} views, usable=True" in repr(answer)


def test_sizes_and_heights_are_options_of_the_program(tmp_path):
    robot, target, X, _ = cell("eye-to-hand", 20)
    target[:, :3, 3] /= 1.2  # a print that is larger than stated
    np.savez(tmp_path / "pairs.npz", robot=robot, target=target)
    for arguments, words in [({"target_size": "solved"}, ["--target-size", "solved"]), ({"target_size_sd": 0.1}, ["--target-size-sd", 0.1]),
                             ({"target_size": "solved", "lens": "stated"}, ["--target-size", "solved", "--lens", "stated"])]:
        answer = flash_calib.handeye_pairs("eye-to-hand", robot, target, **arguments)
        said = json.loads(program("handeye", tmp_path / "pairs.npz", "--setup", "eye-to-hand", "--json", "--quiet", *words,
                                  code=0 if answer.usable else 3))
        assert without(answer.summary) == without(said)
    assert answer.focal_length is None
    solved = flash_calib.handeye_pairs("eye-to-hand", robot, target, target_size="solved")
    assert solved.focal_length.estimate == pytest.approx(1, abs=4 * solved.focal_length.sd)
    assert solved.size.estimate == pytest.approx(1.2, abs=4 * solved.size.sd) and solved.size.prior_sd is None
    expect_truth(solved, X)
    doubted = flash_calib.handeye_pairs("eye-to-hand", robot, target)
    assert not doubted.usable and "target_size solved" in doubted.refusals[0] and doubted.warnings[0].startswith(doubted.refusals[0])


def test_layouts_of_arrays_change_nothing():
    robot, target, _, _ = cell("eye-in-hand", 12)
    answer = flash_calib.handeye_pairs("eye-in-hand", robot, target)
    wide = np.zeros((12, 8, 8))
    wide[:, ::2, ::2] = robot
    frozen = target.copy()
    frozen.setflags(write=False)
    for a, b in [(wide[:, ::2, ::2], frozen), (robot.tolist(), list(target)), (np.asfortranarray(robot), target[:, :3])]:
        assert flash_calib.handeye_pairs("eye-in-hand", a, b, threads=1).text == answer.text
    short = flash_calib.handeye_pairs("eye-in-hand", robot.astype(np.float32), target)
    assert np.allclose(short.T, answer.T, atol=1e-5)

    def rows(poses):
        """x y z qx qy qz qw, of rotations by less than half a turn."""
        w = np.sqrt(1 + np.trace(poses[:, :3, :3], axis1=1, axis2=2)) / 2
        skew = np.stack([poses[:, 2, 1] - poses[:, 1, 2], poses[:, 0, 2] - poses[:, 2, 0], poses[:, 1, 0] - poses[:, 0, 1]], axis=1)
        return np.concatenate([poses[:, :3, 3], skew / (4 * w[:, None]), w[:, None]], axis=1)

    assert np.allclose(flash_calib.handeye_pairs("eye-in-hand", rows(robot), rows(target)).T, answer.T, atol=1e-7)


def test_answers_are_kept_in_files(tmp_path):
    robot, target, X, _ = cell("eye-to-hand", 16)
    answer = flash_calib.handeye_pairs("eye-to-hand", robot, target)
    answer.save(tmp_path / "camera.json")
    assert os.listdir(tmp_path) == ["camera.json"]
    found = flash_calib.load(tmp_path / "camera.json")
    assert found.summary == answer.summary and found.text == answer.text and found.repeatable is None
    assert np.array_equal(found.covariance, answer.covariance) and np.allclose(found.T, answer.T, atol=1e-14)
    assert found.held_out == answer.held_out and found.noise == answer.noise and found.weakest == answer.weakest
    program("export", tmp_path / "camera.json", "--to", "urdf", "--quiet", "-o", tmp_path / "camera.urdf")
    assert "camera" in (tmp_path / "camera.urdf").read_text()
    target[8:, :3, 3] += target[8:, :3, 0] * 0.05  # the target slips in the gripper by 50 mm
    moved = flash_calib.handeye_pairs("eye-to-hand", robot, target)
    assert not moved.usable and moved.refusals
    moved.save(str(tmp_path / "camera.json"))
    with pytest.raises(ValueError, match="load: .*camera.json: .*despite_doubts"):
        flash_calib.load(tmp_path / "camera.json")
    assert flash_calib.load(tmp_path / "camera.json", despite_doubts=True).refusals == moved.refusals


def test_pictures_are_answered_as_by_the_program(tmp_path):
    """Corners that the program finds, handed in as arrays."""
    wrist = ROOT / "examples" / "handeye" / "wrist"
    program("detect", wrist, "--quiet", "-o", tmp_path / "corners.json")
    found = json.loads((tmp_path / "corners.json").read_text())
    said = json.loads(program("handeye", wrist, "--json", "--quiet"))
    words = said["provenance"]["target"]
    corners = []
    for view in found["views"]:
        seen = np.full((len(found["target_points"]), 2), np.nan)
        reading = next((one for one in view["readings"] if one["refiner"] == said["provenance"]["refiner"]), view["readings"][0])
        seen[reading["points"]] = reading["pixels"]
        corners.append(seen)
    poses = np.loadtxt(wrist / "poses.tum")[:, 1:]
    camera = flash_calib.load_camera(wrist / "camera_info.yaml")
    answer = flash_calib.handeye_corners("eye-in-hand", poses, corners, words, camera)
    assert np.array_equal(flash_calib.target_points(words), found["target_points"])
    named = json.loads(json.dumps(said))
    for i, view in enumerate(named["views"]):
        view["image"] = f"view {i}"
    assert without(answer.summary, "warnings") == without(named, "warnings")
    truth = np.loadtxt(wrist / "truth" / "X_and_Z.tum")[0, 1:]
    assert np.allclose(answer.T[:3, 3], truth[:3], atol=4 * answer.sd[:3].max())
    assert answer.lens.camera.fx == pytest.approx(camera.fx, rel=0.01) and answer.lens.sd.shape == (9,)
    # The same points without words: no marker's edge is known, and a ChArUco board has none.
    plain = flash_calib.handeye_corners("eye-in-hand", poses, corners, flash_calib.target_points(words), camera)
    assert np.array_equal(plain.T, answer.T)


@pytest.mark.parametrize("setup", SETUPS)
def test_corners_give_the_camera_and_its_lens(setup):
    robot, corners, points, X, Z = pictures(setup, 14)
    stated = flash_calib.Camera(640, 480, 650.0, 652.0, 320.0, 240.0, (-0.11, 0.07, 0.0004, -0.0003))
    answer = flash_calib.handeye_corners(setup, robot, corners, points, stated)
    expect_truth(answer, X)
    assert answer.usable and answer.lens.excluded and answer.lens.stated.fx == 650
    assert abs(answer.lens.camera.fx - CAMERA.fx) < 4 * answer.lens.sd[0] and 0 < answer.lens.sd[0] < 2
    assert answer.noise.corners == pytest.approx(0.1, rel=0.2) and answer.held_out.corners > 0
    assert np.allclose(answer.target_pose[:3, 3], Z[:3, 3], atol=5e-3) and answer.size.sd > 0
    kept = flash_calib.handeye_corners(setup, robot, corners, points, CAMERA, lens="stated", target_size="stated")
    assert kept.lens.sd.max() == 0 and kept.size.sd == 0
    expect_truth(kept, X)


def test_what_was_not_seen_is_left_out():
    robot, corners, points, X, _ = pictures("eye-in-hand", 12)
    whole = flash_calib.handeye_corners("eye-in-hand", robot, corners, points, CAMERA)
    given = [*corners]
    given[3], given[5] = None, np.full((30, 2), np.nan)
    given[7] = given[7].copy()
    given[7][:12] = np.nan
    given[9] = given[9][np.random.default_rng(1).permutation(30)]  # numbered at random
    answer = flash_calib.handeye_corners("eye-in-hand", robot, given, points, CAMERA)
    assert np.flatnonzero(~answer.used).tolist() == [3, 5, 9]
    assert answer.reasons[3] == answer.reasons[5] == "found 0 corners, expected 4 or more" and "the corners fit" in answer.reasons[9]
    expect_truth(answer, X)
    turned = [view[::-1] if i % 3 == 0 else view for i, view in enumerate(corners)]
    either = flash_calib.handeye_corners("eye-in-hand", robot, turned, points, CAMERA, any_end=True)
    assert either.used.all() and np.allclose(either.T, whole.T, atol=1e-5)


def test_markers_are_corners_with_edges():
    words = "aruco_grid:3x2:0.06:0.02:DICT_5X5_100"
    points = flash_calib.target_points(words)
    robot, corners, _, X, _ = pictures("eye-in-hand", 12, points=points)
    corners[4, 5] = np.nan  # of a marker one corner: its edges are not known
    answer = flash_calib.handeye_corners("eye-in-hand", robot, corners, words, CAMERA)
    assert answer.summary["edges"] is not None and answer.summary["provenance"]["target"] == words
    expect_truth(answer, X)
    plain = flash_calib.handeye_corners("eye-in-hand", robot, corners, points, CAMERA)
    assert plain.summary["edges"] is None


def test_other_threads_run_meanwhile():
    robot, target, _, _ = cell("eye-in-hand", 60)
    answers = []
    worker = threading.Thread(target=lambda: answers.append(flash_calib.handeye_pairs("eye-in-hand", robot, target, threads=1)))
    turns = 0
    worker.start()
    while worker.is_alive():
        time.sleep(1e-4)
        turns += 1
    assert answers and turns > 20  # with the lock held there is a turn or two


def test_the_package_stands_by_itself_and_is_one_of_flash_sim():
    from flash_sim import calib
    assert calib.handeye_pairs is flash_calib.handeye_pairs and flash_sim.calib is calib
    assert set(calib.__all__) == set(flash_calib.__all__) and "calib" in dir(flash_sim)
    assert flash_calib.__version__ == flash_sim.__version__ in program("--version")
    folder = pathlib.Path(flash_calib.__file__).parent
    assert (folder / "py.typed").exists()
    alone = "import sys, flash_calib; assert not [m for m in sys.modules if m.startswith('flash_sim')]"
    subprocess.run([sys.executable, "-P", "-c", alone], check=True)
    absent = "import sys; sys.modules['flash_calib'] = None; import flash_sim.calib"
    done = subprocess.run([sys.executable, "-P", "-c", absent], capture_output=True, text=True)
    assert "found no package flash_calib, expected that of the wheel flash-calib" in done.stderr.splitlines()[-1]
    linked = subprocess.run(["ldd", *folder.glob("_core*.so")], capture_output=True, text=True, check=True).stdout
    assert "libcholmod" in linked and "opencv" not in linked  # of Ceres; pictures are the program's


BAD_POSES = [np.full((9, 4, 4), np.nan), np.zeros((9, 4, 4)), np.zeros((9, 7)), np.eye(4), np.zeros((9, 5)), [], [[]], "poses", None, {}, 3,
             np.full((9, 4, 4), "a"), np.tile(np.eye(4), (9, 1, 1)) * 1j, np.tile(np.diag([1, 1, -1, 1.0]), (9, 1, 1)),
             np.tile(np.diag([1, 1, 1.1, 1]), (9, 1, 1)), np.tile(np.eye(4, dtype=bool), (9, 1, 1)), [np.eye(4), np.eye(3)],
             np.array([None] * 9), np.full((9, 7), 1e300), np.tile([0, 0, 0, 0, 0, 0, 2.0], (9, 1)), np.tile(np.eye(4), (3, 1, 1))]


def refused(call, *arguments, match="", **named):
    with pytest.raises((ValueError, TypeError)) as raised:
        call(*arguments, **named)
    text = str(raised.value)
    assert "\n" not in text and "incompatible function arguments" not in text and "--" not in text, text
    assert match in text, text
    return text


@pytest.mark.parametrize("bad", BAD_POSES, ids=range(len(BAD_POSES)))
def test_poses_that_are_none_are_refused(bad):
    robot, target, _, _ = cell("eye-in-hand", 9)
    _, corners, points, _, _ = pictures("eye-in-hand", 9)
    for given, name in [((bad, target), "T_base_gripper"), ((robot, bad), "T_camera_target")]:
        text = refused(flash_calib.handeye_pairs, "eye-in-hand", *given, match="handeye_pairs: ")
        assert name in text or "T_camera_target" in text, text
        assert "found" in text or "expected" in text or "length" in text, text
    refused(flash_calib.handeye_corners, "eye-in-hand", bad, corners, points, CAMERA, match="handeye_corners: ")


def test_poses_that_tell_nothing_are_named():
    for count in (0, 1, 2, 3):
        robot, target, _, _ = cell("eye-to-hand", max(count, 1))
        refused(flash_calib.handeye_pairs, "eye-to-hand", robot[:count], target[:count], match=f"{count} of {count} views can be used")
    robot, target, X, _ = cell("eye-to-hand", 14)
    refused(flash_calib.handeye_pairs, "eye-to-hand", np.tile(robot[0], (14, 1, 1)), target, match="the robot does not move")
    mm = robot.copy()
    mm[:, :3, 3] *= 1e3
    refused(flash_calib.handeye_pairs, "eye-to-hand", mm, target, match="millimetres")
    refused(flash_calib.handeye_pairs, "eye-to-hand", np.linalg.inv(robot), target, match="invert")
    refused(flash_calib.handeye_pairs, "eye-to-hand", np.roll(robot, 1, axis=0), target, match="off by one")
    refused(flash_calib.handeye_pairs, "eye-to-hand", robot, np.random.default_rng(1).permutation(target))
    left = target.copy()
    left[:, :, 0] *= -1
    refused(flash_calib.handeye_pairs, "eye-to-hand", robot, left, match="mirrors")
    small = target.copy()
    small[:, :3, 3] *= 1e3
    refused(flash_calib.handeye_pairs, "eye-to-hand", robot, small, match="T_camera_target: found half of the poses beyond")


def test_other_arguments_are_refused_by_name():
    robot, target, _, _ = cell("eye-in-hand", 9)
    _, corners, points, _, _ = pictures("eye-in-hand", 9)
    for setup in ("", "in hand", None, 3):
        refused(flash_calib.handeye_pairs, setup, robot, target, match="setup: found")
    for name, values in {"target_size": ["large", 3], "target_size_sd": [-1, np.nan, 2, "x", [1, 2]], "camera_height": [np.nan, 50, (0.3, 0), "x", {}],
                         "held_out_seed": [-1, 0.5, "x", True], "threads": [-1, 1.5, None, 10**9]}.items():
        for value in values:
            refused(flash_calib.handeye_pairs, "eye-in-hand", robot, target, match=f"{name}: found", **{name: value})
    refused(flash_calib.handeye_pairs, "eye-in-hand", robot, target, camera_height=0.3, match="camera_height: the robot turns about more")
    refused(flash_calib.handeye_pairs, "eye-in-hand", robot, target, camera_height=1, target_height=1, match="found both")
    refused(flash_calib.handeye_pairs, "eye-in-hand", robot, target, target_size="solved", target_size_sd=0.1, match="expected one of both")
    refused(flash_calib.handeye_pairs, "eye-in-hand", robot, target[:8], match="found 8 poses, expected 9")

    def call(seen=corners, places=points, camera=CAMERA, match="", **named):
        refused(flash_calib.handeye_corners, "eye-in-hand", robot, seen, places, camera, match=match, **named)

    for seen in [None, "x", 3, [], corners[:8], corners[:, :5], [None] * 9, np.full((9, 30, 2), np.inf), np.full((9, 30, 2), 1e9), [["a"]] * 9, {},
                 np.array(5.0), np.zeros_like(corners), np.random.default_rng(1).uniform(0, 480, corners.shape)]:
        call(seen=seen)
    for places in [None, 3, points[:, :2], points[:3], np.zeros((30, 3)), points * [1, 0, 1], points + [0, 0, 1], points * 1e3, np.full((30, 3), np.nan),
                   np.random.default_rng(1).uniform(0, 0.2, (30, 3))]:
        call(places=places, match="points: found")
    for words in ["", "chessboard", "chessboard:9x6", "chessboard:0x0:0.02", "chessboard:9x6:-1", "\ud800", "a\0"]:
        call(places=words, match="target_points: ")
    changed = {"width": [0, 1.5, None], "fx": [0, -3, np.nan, "x"], "cy": [np.inf], "distortion": [(1,), (1,) * 6, (np.nan,) * 5, (1e9,) * 4, "x"],
               "covariance": [np.eye(3), np.ones((9, 9)), -np.eye(9), np.eye(13), "x", np.full((9, 9), np.nan)]}
    for name, values in changed.items():
        for value in values:
            call(camera=flash_calib.Camera(**{**vars(CAMERA), name: value}), match=f"camera: {name}: found")
    call(camera=np.eye(3), match="expected a flash_calib.Camera")
    call(use="pictures", match="use: found")
    call(lens="new", match="lens: found")
    call(any_end=1, match="any_end: found")


def test_masks_and_halves_of_corners_are_refused():
    robot, target, _, _ = cell("eye-in-hand", 9)
    hidden = np.ma.masked_array(robot, np.arange(9)[:, None, None] == 3 + np.zeros((9, 4, 4)))
    refused(flash_calib.handeye_pairs, "eye-in-hand", hidden, target, match="T_base_gripper: found an array with a mask")
    corners = [np.full((len(board()), 2), 100.0) for _ in robot]
    corners[2][5, 1] = np.nan
    refused(flash_calib.handeye_corners, "eye-in-hand", robot, corners, board(), CAMERA, match="view 2: found nan in one column of corner 5")


def test_files_that_are_none_are_refused(tmp_path):
    for text in ("", "{}", "[1]", "{", '{"schema": "flash-extrinsics/2"}'):
        (tmp_path / "camera.json").write_text(text)
        refused(flash_calib.load, tmp_path / "camera.json", match="camera.json")
        refused(flash_calib.load_camera, tmp_path / "camera.json", match="camera.json")
    for path in (tmp_path / "none.json", tmp_path, "", None, 3, "a\0b"):
        refused(flash_calib.load, path, match="load: ")
        refused(flash_calib.load_camera, path, match="load_camera: ")
    robot, target, _, _ = cell("eye-in-hand", 9)
    answer = flash_calib.handeye_pairs("eye-in-hand", robot, target)
    with pytest.raises(OSError):
        answer.save(tmp_path / "nowhere" / "camera.json")
    for missing in ("transform", "views", "residuals", "covariance", "warnings", "predicted_sd"):
        (tmp_path / "camera.json").write_text(json.dumps({k: v for k, v in answer.summary.items() if k != missing}))
        refused(flash_calib.load, tmp_path / "camera.json", match=missing)
    for name in ("transform", "views", "residuals", "predicted_sd", "sigmas", "observability", "warnings", "scale"):
        for wrong in (7, "seven", [7], {"seven": 7}, None):
            if (name, wrong) != ("scale", None):
                (tmp_path / "camera.json").write_text(json.dumps({**answer.summary, name: wrong}))
                with pytest.raises(ValueError, match="load: .*camera.json: "):
                    flash_calib.load(tmp_path / "camera.json")
    assert len(board()) == 30
