"""What python -m flash_sim.bag refuses: one line that names it, exit code 2, and nothing left behind."""
import io
import struct
import sys

import bag_fixtures as fixtures
import numpy as np
import pytest
from bag_fixtures import LATE, SECOND, START, Cell, between, pose, rotation

from flash_sim.bag.__main__ import main

pytest.importorskip("rosbags", reason="rosbags is not installed, which reads bags")
pytest.importorskip("PIL", reason="Pillow is not installed, which reads compressed pictures")

MS = 1_000_000
COLOUR, COLOUR_INFO = "/camera/color/image_raw", "/camera/color/camera_info"
DEPTH, DEPTH_INFO = "/camera/depth/image_raw", "/camera/depth/camera_info"
WIDTH, HEIGHT = 16, 12
LENS = fixtures.lens(WIDTH, HEIGHT, 14.0)
DEPTH_LENS = fixtures.lens(WIDTH, HEIGHT, 12.0)
STOPS = [pose([0.4 + 0.02 * k, 0.03 * k, 0.3], rotation([1, 0.3 * k, 0.1], 2.8 + 0.1 * k)) for k in range(5)]
PIXELS = np.arange(WIDTH * HEIGHT * 3, dtype=np.uint8).reshape(HEIGHT, WIDTH, 3)
COUNTS = (500 + np.arange(WIDTH * HEIGHT, dtype=np.uint16)).reshape(HEIGHT, WIDTH)


def small(pictures=True, poses=True, infos=True, pictures_late=0, infos_late=0, shift=0, step=20):
    """Five stops of a second each with a picture in the middle; what is not wanted is left out for a test to add."""
    cell = Cell()
    for time in range(0, 5000, step) if poses else ():
        stop = min(time // 1000, 4)
        share = max(time % 1000 - 800, 0) / 200
        tool = between(STOPS[stop], STOPS[min(stop + 1, 4)], share)
        cell.tf(START + time * MS, ("base_link", "tool0", tool))
    for time in picture_times():
        if pictures:
            cell.image(COLOUR, time + pictures_late * MS + shift, PIXELS, "rgb8")
        if infos:
            cell.info(COLOUR_INFO, time + infos_late * MS + shift, LENS)
    return cell


def picture_times():
    """Ten a second, of which those in the middle of a stop are still."""
    return [START + time * MS for time in range(0, 5000, 100)]


def add_depth(cell, lens=LENS, frame="camera_optical", late=0, topic=DEPTH, pixels=COUNTS, encoding="16UC1", log=LATE):
    for time in picture_times():
        cell.image(topic, time + late * MS, pixels, encoding, frame, log)
        cell.info(topic.rsplit("/", 1)[0] + "/camera_info", time + late * MS, lens, frame)
    return cell


def left(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def refused(capsys, folder, source, *words):
    """The line that a call refuses with."""
    before = left(folder)
    try:
        code = main([str(source), "-o", str(folder / "out"), "--quiet", *words])
    except SystemExit as end:
        code = end.code
    error = capsys.readouterr().err
    lines = [line for line in error.splitlines() if "warning:" not in line]
    assert code == 2 and len(lines) == 1, (code, error)
    assert left(folder) == before
    return lines[0]


@pytest.fixture
def refuse(tmp_path, capsys):
    """Writes a cell and returns what it is refused with."""
    def call(cell, *words):
        folder = tmp_path / str(len(list(tmp_path.iterdir())))
        folder.mkdir()
        return refused(capsys, folder, cell.write(folder, "mcap"), *words)
    return call


def test_a_sound_recording_is_taken(tmp_path):
    """So that what the tests below change is what is refused."""
    assert main([str(add_depth(small()).write(tmp_path, "mcap")), "-o", str(tmp_path / "out"), "--quiet"]) == 0
    assert left(tmp_path / "out/depth") == left(tmp_path / "out/images") == [f"{k:06d}.png" for k in range(5)]


@pytest.mark.parametrize("name, word", [("a.svo", "svo_export.py"), ("a.svo2", "svo_export.py"), ("a.mkv", "ffmpeg -i"),
                                        ("a.zdf", "convert_zdf.py")])
def test_files_of_vendors_name_the_command_that_exports_them(tmp_path, capsys, name, word):
    (tmp_path / name).write_bytes(b"x")
    line = refused(capsys, tmp_path, tmp_path / name)
    assert name in line and word in line and "vendor" in line


def test_a_bag_without_an_index_names_reindex(tmp_path, capsys):
    path = small().write(tmp_path, "ros1")
    data = path.read_bytes()
    at = data.index(b"index_pos=") + len(b"index_pos=")
    path.write_bytes(data[:at] + bytes(8) + data[at + 8:])
    assert f"rosbag reindex {path}" in refused(capsys, tmp_path, path)
    path.write_bytes(data[:len(data) - 300])
    assert f"rosbag reindex {path}" in refused(capsys, tmp_path, path)


@pytest.mark.parametrize("name, content", [("a.bag", b""), ("a.bag", b"no bag at all\n"), ("a.mcap", b"\x89MCAP0\r\n"),
                                           ("a.mcap", b""), ("a.db3", b"SQLite format 3\0"), ("a.db3", b""), ("a.txt", b"x")])
def test_files_that_are_no_recordings(tmp_path, capsys, name, content):
    (tmp_path / name).write_bytes(content)
    assert name in refused(capsys, tmp_path, tmp_path / name)


def test_what_is_not_there_or_is_another_folder(tmp_path, capsys):
    assert "no such file" in refused(capsys, tmp_path, tmp_path / "none.bag")
    (tmp_path / "folder").mkdir()
    assert "metadata.yaml" in refused(capsys, tmp_path, tmp_path / "folder")


def test_every_cut_of_a_file_is_one_line(tmp_path, capsys):
    """Of all three kinds, at places that are drawn."""
    random = np.random.default_rng(7)
    for container in ("ros1", "mcap", "db3"):
        (tmp_path / container).mkdir()
        path = small().write(tmp_path / container, container)
        data = path.read_bytes()
        for size in random.integers(1, len(data) - 200, 12):
            path.write_bytes(data[:size])
            line = refused(capsys, tmp_path, path)
            assert str(path) in line


def test_a_gap_between_poses(refuse):
    cell = small()
    cell.entries = [entry for entry in cell.entries if entry[0] != "/tf" or not START + 900 * MS < entry[2] < START + 1200 * MS]
    line = refuse(cell)
    assert "/tf base_link to tool0" in line and "gap of 0.3" in line and "at most 0.1 s" in line
    assert "gap" in refuse(small(step=120))


def test_two_clocks(refuse):
    line = refuse(small(shift=685 * SECOND - START))
    assert "two clocks" in line and "/tf" in line and COLOUR in line and "685.000000000" in line
    assert "no time that both have" in refuse(small(shift=100 * SECOND))


def test_stamps_that_lag_behind_those_that_arrived_with_them(refuse):
    """OrbbecSDK_v2#116: 667 to 800 ms between colour, depth and CameraInfo, which a nearest stamp would hide."""
    line = refuse(add_depth(small(), late=667, log=LATE - 667 * MS))
    assert COLOUR in line and DEPTH in line and "+0.667 s apart" in line
    cell = small(infos=False)
    for time in picture_times():
        cell.info(COLOUR_INFO, time - 800 * MS, LENS, late=LATE + 800 * MS)
    line = refuse(cell)
    assert COLOUR in line and "camera_info" in line and "-0.800 s apart" in line


def test_pairs_beyond_half_a_frame(tmp_path, capsys):
    source = add_depth(small(), late=45).write(tmp_path, "mcap")
    assert main([str(source), "-o", str(tmp_path / "near")]) == 0
    assert "skew of /camera/color/image_raw and /camera/depth/image_raw: 45.0 ms" in capsys.readouterr().out
    (tmp_path / "far").mkdir()
    cell = small()
    for time in picture_times()[::4]:  # depth comes rarely
        cell.image(DEPTH, time + 60 * MS, COUNTS, "16UC1")
        cell.info(DEPTH_INFO, time + 60 * MS, LENS)
    line = refused(capsys, tmp_path, cell.write(tmp_path / "far", "mcap"))
    assert COLOUR in line and DEPTH in line and "half a frame, 50.0 ms" in line


def test_stamps_of_camera_info_of_another_clock(refuse):
    line = refuse(small(infos_late=800_000))
    assert "camera_info" in line and "no time that both have" in line


def test_stamps_of_zero_and_stamps_twice(refuse):
    cell = small(pictures=False)
    for _ in range(3):
        cell.image(COLOUR, 0, PIXELS, "rgb8", late=START)
    assert "stamp 0" in refuse(cell)
    cell = small()
    cell.image(COLOUR, picture_times()[3], PIXELS, "rgb8")
    assert "with the stamp of another" in refuse(cell)


def test_pictures_that_change_their_size_or_are_not_of_their_lens(refuse):
    cell = small(pictures=False)
    for k, time in enumerate(picture_times()):
        cell.image(COLOUR, time, PIXELS if k < 15 else PIXELS[:10], "rgb8")
    assert "16 x 10 after 16 x 12" in refuse(cell)
    cell = small(infos=False)
    for time in picture_times():
        cell.info(COLOUR_INFO, time, fixtures.lens(32, 24, 28.0))
    line = refuse(cell)
    assert "32 x 24" in line and "16 x 12" in line


@pytest.mark.parametrize("changes, words", [
    ({"distortion_model": "equidistant", "d": [0.1, 0, 0, 0]}, ("equidistant", "plumb_bob", "--camera-info")),
    ({"distortion_model": "Kannala Brandt4", "d": [0.1, 0, 0, 0, 0]}, ("Kannala Brandt4", "plumb_bob")),
    ({"distortion_model": "Inverse Brown Conrady", "d": [0.1, 0, 0, 0, 0]}, ("Inverse Brown Conrady",)),
    ({"distortion_model": "plumb_bob", "d": [0.1, 0, 0, 0, 0, 0.2, 0, 0]}, ("8 coefficients", "at most 5")),
    ({"distortion_model": "rational_polynomial", "d": [0.1] * 12}, ("12 coefficients", "expected 8")),
    ({"k": [0] * 9}, ("focal length of 0",)),
    ({"d": [0.1, float("nan"), 0, 0, 0]}, ("distortion 0.1, nan", "finite"))])
def test_lenses_that_are_not_read(refuse, changes, words):
    cell = small(infos=False)
    cell.info(COLOUR_INFO, START, LENS, **changes)
    line = refuse(cell)
    assert COLOUR_INFO in line and all(word in line for word in words), line


def test_files_that_hold_no_lens(tmp_path, capsys):
    source = small(infos=False).write(tmp_path, "mcap")
    other = tmp_path / "notes.txt"
    for text in ("root:x:0:0\n", ""):
        other.write_text(text)
        assert main([str(source), "-o", str(tmp_path / "out"), "--camera-info", str(other)]) == 2
        assert "notes.txt" in (line := capsys.readouterr().err) and "found no lens" in line
    assert not (tmp_path / "out").exists()


def test_no_views_are_refused(tmp_path, capsys):
    assert main([str(small().write(tmp_path, "mcap")), "-o", str(tmp_path / "out"), "--views", "0"]) == 2
    assert "--views: expected a number above 0" in capsys.readouterr().err


def test_files_that_are_not_used_are_told(tmp_path, capsys):
    source = small().write(tmp_path, "mcap")
    assert main([str(source), "-o", str(tmp_path / "out"), "--extrinsics", "camera.json"]) == 0
    assert "--extrinsics camera.json: is not used" in capsys.readouterr().err


def test_lenses_that_change_or_are_not_there(refuse):
    cell = small()
    cell.info(COLOUR_INFO, picture_times()[-1] + MS, fixtures.lens(WIDTH, HEIGHT, 15.0))
    assert "two lenses (fx 14 and 15" in refuse(cell)
    assert "no camera_info" in refuse(small(infos=False))


def test_depth_of_eight_bits(refuse):
    line = refuse(add_depth(small(), pixels=COUNTS.astype(np.uint8), encoding="mono8"))
    assert DEPTH in line and "mono8" in line and "16UC1" in line
    from PIL import Image
    file = io.BytesIO()
    Image.fromarray(COUNTS.astype(np.uint8)).save(file, "JPEG")
    cell = small()
    for time in picture_times():
        cell.compressed(f"{DEPTH}/compressed", time, file.getvalue(), "jpeg")
        cell.info(DEPTH_INFO, time, LENS)
    assert "jpeg" in refuse(cell) and "lost it" in refuse(cell)


@pytest.mark.parametrize("form, header, words", [
    ("16UC1; compressedDepth rvl", (1, 0, 0), ("RVL", "png")),
    ("32FC1; compressedDepth png", (0, 0, 0), ("inverse depth", "parameters 0 and 0"))])
def test_compressed_depth_that_cannot_be_undone(refuse, form, header, words):
    cell = small()
    for time in picture_times():
        cell.compressed(f"{DEPTH}/compressedDepth", time, struct.pack("<iff", *header) + fixtures.png16(COUNTS), form)
        cell.info(DEPTH_INFO, time, LENS)
    line = refuse(cell)
    assert DEPTH in line and all(word in line for word in words), line


def test_depth_on_other_pixels_without_extrinsics(refuse):
    line = refuse(add_depth(small(), DEPTH_LENS, "depth_optical"))
    assert DEPTH in line and "not aligned" in line and "no extrinsics" in line
    # The frame says that they are the same pixels, and the lens that they are not.
    assert "not aligned" in refuse(add_depth(small(), DEPTH_LENS))


def test_extrinsics_that_are_no_rotation(refuse):
    """K4A-Wrapper#109: R(0,0) = .988995."""
    cell = add_depth(small(), DEPTH_LENS, "depth_optical")
    turn = np.eye(3)
    turn[0, 0] = 0.988995
    cell.add("/camera/extrinsics/depth_to_color", "realsense2_camera_msgs/msg/Extrinsics", START, rotation=turn.ravel(),
             translation=[0.015, 0, 0])
    line = refuse(cell)
    assert "depth_to_color" in line and "0.988995" in line and "rotation to 0.001" in line
    cell.entries[-1][3].update(rotation=np.eye(3).ravel(), translation=[15.0, 0, 0])
    assert "millimetres" in refuse(cell)


def test_transforms_that_are_none(refuse):
    cell = small(poses=False)
    cell.tf(START, ("base_link", "tool0", pose([0, 0, 1])))
    cell.entries[-1][3]["transforms"][0]["transform"]["rotation"]["w"] = 0.9
    assert "quaternion of length 0.9" in refuse(cell)
    cell = small()
    cell.tf(START, ("world", "tool0", pose([0, 0, 1])))
    assert "found tool0 on base_link and on world" in refuse(cell)
    assert "found no frame elbow" in refuse(small(), "--tool", "elbow")
    cell = small()
    cell.tf(START, ("map", "odom", pose([0, 0, 1])))
    assert "no chain of transforms from base_link to odom" in refuse(cell, "--tool", "odom")
    cell = small()
    cell.tf(START, ("base_link", "camera", pose([0, 0, 1])), static=True)
    cell.tf(START, ("base_link", "camera", pose([0, 0, 2])), static=True)
    assert "two transforms that differ" in refuse(cell)
    assert "stands still on the base" in refuse(cell if cell.entries.pop() else cell, "--tool", "camera")


def test_poses_that_are_not_there_or_too_many(refuse):
    assert "no poses of the robot" in refuse(small(poses=False))
    cell = small()
    cell.add("/tool_pose", "geometry_msgs/msg/PoseStamped", START, pose={"orientation": {"w": 1}})
    line = refuse(cell)
    assert "/tool_pose, /tf" in line and "--topics" in line
    cell = small(poses=False)
    cell.add("/joint_states", "sensor_msgs/msg/JointState", START, name=["a"], position=[0.1])
    assert "robot_description" in refuse(cell)
    cell.add("/robot_description", "std_msgs/msg/String", START, data="<robot><joint")
    assert "found no XML" in refuse(cell)


def test_a_franka_matrix_row_by_row(refuse):
    """O_T_EE is column by column; read the other way its last row holds the place."""
    cell = small(poses=False)
    matrix = pose([0.4, 0, 0.3], rotation([1, 0, 0], 3.0))
    matrix[0, 0] = 0.988995
    cell.add("/franka_state", "franka_msgs/msg/FrankaState", START, O_T_EE=matrix.T.ravel())
    line = refuse(cell)
    assert "O_T_EE" in line and "0.988995" in line
    cell.entries[-1][3]["O_T_EE"] = pose([0.4, 0, 0.3]).ravel()
    assert "row by row" in refuse(cell)


def test_an_arm_that_never_stands_still(refuse):
    cell = small(poses=False)
    for time in range(0, 5000, 20):
        cell.tf(START + time * MS, ("base_link", "tool0", between(STOPS[0], STOPS[4], time / 5000)))
    line = refuse(cell)
    assert "0 places" in line and "--every" in line


def test_several_cameras_and_wrong_topics(refuse):
    cell = small()
    cell.image("/other/color/image_raw", START, PIXELS, "rgb8")
    line = refuse(cell)
    assert COLOUR in line and "/other/color/image_raw" in line and "--topics" in line
    assert "no topic /nothing" in refuse(small(), "--topics", "/nothing")
    assert "found no pictures" in refuse(add_depth(small(pictures=False, infos=False)))
    assert "found no depth" in refuse(small(), "--for", "segment")


def test_pictures_that_cannot_be_decoded(refuse):
    cell = small(pictures=False)
    for time in picture_times():
        cell.compressed(COLOUR, time, b"\xff\xd8\xff\xe0 no more", "jpeg")
    assert "cannot be read" in refuse(cell)
    cell = small(pictures=False)
    for time in picture_times():
        cell.image(COLOUR, time, PIXELS[:, :, :2], "yuv422")
    assert "yuv422" in refuse(cell) and "rgb8" in refuse(cell)
    cell = small()
    for entry in cell.entries:
        if entry[0] == COLOUR:
            entry[3]["height"] = 40
    assert "expected 1920" in refuse(cell)


def test_folders_that_are_there_and_options_that_are_wrong(tmp_path, capsys):
    source = small().write(tmp_path, "sqlite_folder")
    (tmp_path / "out").mkdir()
    (tmp_path / "out/mine.txt").write_text("mine")
    assert "--force" in refused(capsys, tmp_path, source)
    assert "is read by this run" in refused(capsys, tmp_path, source, "-o", str(source), "--force")
    assert "is read by this run" in refused(capsys, tmp_path, source, "-o", str(source / "out"))
    assert "found no depth" in refused(capsys, tmp_path, source, "-o", str(tmp_path / "made/on/the/way"), "--for", "segment")
    (tmp_path / "file").write_text("mine")
    assert "file/out" in refused(capsys, tmp_path, source, "-o", str(tmp_path / "file/out"))
    assert "expected a number" in refused(capsys, tmp_path, source, "--every", "often", "--force")
    assert "invalid choice" in refused(capsys, tmp_path, source, "--for", "grid", "--force")
    assert "--views" in refused(capsys, tmp_path, source, "--views", "-1", "--force")
    assert "none.tum" in refused(capsys, tmp_path, source, "--poses", "none.tum", "--force")


def test_a_part_in_which_nothing_is(refuse):
    assert "between --from and --until" in refuse(small(), "--from", "100")
    assert "between --from and --until" in refuse(add_depth(small()), "--from", "2", "--until", "1", "--for", "segment")


@pytest.mark.parametrize("module", ["rosbags.rosbag2", "PIL"])
def test_packages_that_are_not_there(tmp_path, capsys, monkeypatch, module):
    from PIL import Image
    file = io.BytesIO()
    Image.fromarray(PIXELS).save(file, "PNG")
    cell = small(pictures=False)
    for time in picture_times():
        cell.compressed(f"{COLOUR}/compressed", time, file.getvalue(), "png")
    source = cell.write(tmp_path, "mcap")
    monkeypatch.setitem(sys.modules, module, None)
    assert "pip install 'flash-sim[bag]'" in refused(capsys, tmp_path, source)


def test_force_keeps_what_others_put_there(tmp_path):
    source = small().write(tmp_path, "mcap")
    (tmp_path / "out/images").mkdir(parents=True)
    for name in ("mine.txt", "images/000099.png", "images/board.svg"):
        (tmp_path / "out" / name).write_text("mine")
    assert main([str(source), "-o", str(tmp_path / "out"), "--quiet", "--force"]) == 0
    assert left(tmp_path / "out/images") == [*(f"{k:06d}.png" for k in range(5)), "board.svg"]
    assert (tmp_path / "out/mine.txt").read_text() == "mine"
