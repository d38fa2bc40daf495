"""python -m flash_sim.bag: one recording in five containers becomes one folder, which the programs read."""
import json
import os
import pathlib
import subprocess
import sys

import bag_fixtures as fixtures
import numpy as np
import pytest
from bag_fixtures import CONTAINERS, LATE, SECOND, START, Cell, between, draw_board, pose, rotation

from flash_sim.bag.__main__ import main

pytest.importorskip("rosbags", reason="rosbags is not installed, which reads bags")
pytest.importorskip("PIL", reason="Pillow is not installed, which reads compressed pictures")

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAMS = pathlib.Path(os.environ.get("FLASH_PROGRAMS", ROOT / "build/release/bin"))
BOARD = "chessboard:9x6:0.025"
PICTURES, INFO = "/camera/color/image_raw", "/camera/color/camera_info"
LENS = fixtures.lens()
T_TOOL_CAMERA = pose([0.03, -0.05, 0.08], rotation([1, 0.2, -0.3], 0.15))
T_BASE_BOARD = pose([0.45, -0.05, 0.02], rotation([1, 0, 0], np.pi))
MOVE, REST, TF_STEP = 600, 500, 20  # of the arm between stops, and there [ms]


def places(count):
    """T_base_tool of stops that look at the board from all sides."""
    middle = np.array([0.1, 0.0625, 0])
    found = []
    for k in range(count):
        tilt, about = np.radians(20 + 4 * (k % 4)), 2.4 * k
        turn = rotation([np.cos(about), np.sin(about), 0], tilt) @ rotation([0, 0, 1], 0.5 * np.sin(3.1 * k))
        distance = 0.34 + 0.04 * (k % 3)
        T_board_camera = pose(middle - distance * turn[:, 2] + [0.01 * np.sin(k), 0.01 * np.cos(k), 0], turn)
        found.append(T_BASE_BOARD @ T_board_camera @ np.linalg.inv(T_TOOL_CAMERA))
    return found


def tool_at(stops, milliseconds):
    """T_base_tool of an arm that stops, then moves evenly to the next place."""
    stop, rest = divmod(milliseconds, MOVE + REST)
    share = max(rest - REST, 0) / MOVE
    stop = int(stop)
    return between(stops[min(stop, len(stops) - 1)], stops[min(stop + 1, len(stops) - 1)], share)


def links(tool):
    """/tf of an arm whose tool is there: two joints that move, and between them frames that do not."""
    upper = pose(0.3 * tool[:3, 3], rotation([0, 0, 1], 0.7 * tool[0, 3]))
    lower = np.linalg.inv(FIXED["shoulder"] @ upper) @ tool @ np.linalg.inv(FIXED["tool0"])
    return ("shoulder", "upper_arm", upper), ("upper_arm", "flange", lower)


FIXED = {"shoulder": pose([0, 0, 0.3]), "tool0": pose([0, 0, 0.1], rotation([0, 0, 1], np.pi / 4))}


@pytest.fixture(scope="session")
def stops():
    return places(12)


@pytest.fixture(scope="session")
def drawings(stops):
    """Of each stop what the camera sees."""
    return [draw_board(LENS, np.linalg.inv(stop @ T_TOOL_CAMERA) @ T_BASE_BOARD) for stop in stops]


@pytest.fixture(scope="session")
def wrist(stops, drawings):
    """Stop and go: at 50 Hz /tf, at 10 Hz pictures of which those on the way show nothing."""
    cell = Cell()
    end = len(stops) * (MOVE + REST) - MOVE
    for time in range(-REST, end + 200, TF_STEP):
        cell.tf(START + time * 1_000_000, *links(tool_at(stops, max(time, 0))))
    cell.tf(START, ("base_link", "shoulder", FIXED["shoulder"]), ("flange", "tool0", FIXED["tool0"]), static=True)
    for time in range(50, end, 100):
        stop, rest = divmod(time, MOVE + REST)
        picture = drawings[stop] if rest <= REST else np.full((LENS.height, LENS.width), 90, np.uint8)
        stamp = START + time * 1_000_000 + 7_000_000
        cell.image(PICTURES, stamp, np.repeat(picture[:, :, None], 3, axis=2), "bgr8")
        cell.info(INFO, stamp, LENS)
    return cell


def contents(folder):
    """Bytes of all files by name."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def program(name):
    """A program that was built, or the test is skipped."""
    path = PROGRAMS / name
    if not path.exists():
        pytest.skip(f"{path} is not built; FLASH_PROGRAMS names another folder")
    return path


def calibrated(folder, out):
    """T_gripper_camera, as translation and quaternion, by flash-calib."""
    words = [program("flash-calib"), "handeye", folder, "--setup", "eye-in-hand", "--target", BOARD, "--quiet", "-o", out]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    transform = json.loads(out.read_text())["transform"]
    return np.array([*transform["translation"], *transform["rotation_xyzw"]])


def test_five_containers_give_one_folder_and_the_answer_of_the_pictures_themselves(tmp_path, wrist, stops, drawings):
    folders = []
    for container in CONTAINERS:
        (tmp_path / container).mkdir()
        source = wrist.write(tmp_path / container, container)
        assert main([str(source), "-o", str(tmp_path / container / "set"), "--quiet"]) == 0
        folders.append(contents(tmp_path / container / "set"))
    assert all(folder == folders[0] for folder in folders)
    assert len([name for name in folders[0] if name.startswith("images/")]) == len(stops)

    plain = tmp_path / "plain"
    (plain / "images").mkdir(parents=True)
    from PIL import Image
    lines = []
    for k, (stop, picture) in enumerate(zip(stops, drawings)):
        Image.fromarray(picture).save(plain / f"images/{k:06d}.png")
        lines.append(" ".join(map(repr, [k, *map(float, stop[:3, 3]), *map(float, fixtures.quaternion(stop[:3, :3]))])))
    (plain / "poses.tum").write_text("\n".join(lines) + "\n")
    (plain / "camera_info.yaml").write_bytes(folders[0]["camera_info.yaml"])
    expected = calibrated(plain, tmp_path / "plain.json")
    for container in CONTAINERS:
        found = calibrated(tmp_path / container / "set", tmp_path / f"{container}.json")
        assert np.abs(found - expected).max() < 1e-6, container
    # 0.1 mm: what pictures of 640 x 480 px tell; a reader by log time is 20 mm off (below).
    assert np.abs(expected[:3] - T_TOOL_CAMERA[:3, 3]).max() < 1e-4


def test_poses_are_those_of_the_headers_and_not_of_the_log(tmp_path, wrist, stops):
    """Of a moving arm, where 80 ms are centimetres."""
    source = wrist.write(tmp_path, "mcap")
    assert main([str(source), "-o", str(tmp_path / "set"), "--every", "0.3", "--quiet"]) == 0
    rows = np.loadtxt(tmp_path / "set/poses.tum")
    apart = []
    for line in (tmp_path / "set/pairs.csv").read_text().splitlines()[1:]:
        name, time, _, _ = line.split(",")
        assert (tmp_path / f"set/images/{name}.png").exists() and name == time
        whole, part = time.split(".")
        stamp = int(whole) * SECOND + int(part)
        assert (stamp - START) % 100_000_000 == 57_000_000
        after = int(np.searchsorted(rows[:, 0], float(time)))
        t0, t1 = rows[after - 1, 0], rows[after, 0]
        place = rows[after - 1, 1:4] + (float(time) - t0) / (t1 - t0) * (rows[after, 1:4] - rows[after - 1, 1:4])
        truth = tool_at(stops, (stamp - START) / 1e6)
        # Between two poses of 50 Hz a chain of two joints bends off the line by less than 0.1 mm.
        assert np.abs(place - truth[:3, 3]).max() < 1e-4
        apart.append(np.linalg.norm(tool_at(stops, (stamp + LATE - START) / 1e6)[:3, 3] - truth[:3, 3]))
    assert max(apart) > 0.02  # by the log


def test_pictures_show_each_stop_once_with_its_pose(tmp_path, wrist, stops, drawings):
    source = wrist.write(tmp_path, "ros1")
    assert main([str(source), "-o", str(tmp_path / "set"), "--views", "5", "--quiet"]) == 0
    from PIL import Image
    rows = np.loadtxt(tmp_path / "set/poses.tum")
    assert len(rows) == 5 and (rows[:, 0] == np.arange(5)).all()
    for k, stop in enumerate((0, 3, 6, 8, 11)):
        assert (np.asarray(Image.open(tmp_path / f"set/images/{k:06d}.png"))[:, :, 0] == drawings[stop]).all()
        assert np.abs(rows[k, 1:4] - stops[stop][:3, 3]).max() < 1e-9


def logged_later(cell, late):
    """The same messages; those of /tf arrive `late` [ns] later."""
    other = Cell()
    other.entries = [(topic, kind, time + late * (topic == "/tf"), fields) for topic, kind, time, fields in cell.entries]
    return other


def test_log_times_change_nothing(tmp_path, wrist):
    """Neither another delay nor another order of the log."""
    folders = []
    for name, late in (("a", 0), ("b", -3 * SECOND)):
        other = logged_later(wrist, late)
        (tmp_path / name).mkdir()
        assert main([str(other.write(tmp_path / name, "db3")), "-o", str(tmp_path / name / "set"), "--quiet"]) == 0
        folders.append(contents(tmp_path / name / "set"))
    assert folders[0] == folders[1]


def test_clocks_that_arrive_apart_are_warned_of(tmp_path, wrist, capsys):
    """By a second: no stamp by itself tells."""
    other = logged_later(wrist, SECOND)
    assert main([str(other.write(tmp_path, "mcap")), "-o", str(tmp_path / "set"), "--quiet"]) == 0
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and f"warning: stamps of {PICTURES} lie -1.000 s farther" in error and "/tf" in error


def test_the_compiled_part_is_not_needed(tmp_path, wrist):
    """In a process that has no such module."""
    source = wrist.write(tmp_path, "mcap")
    text = ("import sys; sys.modules['flash_sim._core'] = None\n"
            f"from flash_sim.bag.__main__ import main; sys.exit(main([{str(source)!r}, '-o', {str(tmp_path / 'set')!r}]))")
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=False,
                          env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)})
    assert done.returncode == 0, done.stderr
    assert "12 views" in done.stdout and "flash-calib handeye" in done.stdout


def test_topics_are_listed(tmp_path, wrist, capsys):
    assert main([str(wrist.write(tmp_path, "sqlite_folder"))]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == [INFO, PICTURES, "/tf", "/tf_static"]
    assert "lens" in lines[0] and "pictures, bgr8, frame camera_optical" in lines[1] and "poses" in lines[2]
