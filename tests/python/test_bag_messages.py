"""Messages of python -m flash_sim.bag one by one: poses, pictures, depth, lenses, extrinsics."""
import io
import struct
from types import SimpleNamespace

import bag_fixtures as fixtures
import numpy as np
import pytest
from bag_fixtures import LATE, START, Cell, pose, rotation
from test_bag_refusals import (COLOUR, COLOUR_INFO, COUNTS, DEPTH, DEPTH_INFO, HEIGHT, LENS, MS, PIXELS, STOPS, WIDTH, add_depth,
                               left, picture_times, small)

from flash_sim.bag import alignment, orbbec_sdk, pictures, rigid
from flash_sim.bag.__main__ import main
from flash_sim.bag.lens import Lens, lens_of
from flash_sim.bag.robot_model import robot_model
from flash_sim.bag.robot_poses import JointStream
from flash_sim.bag.streams import PoseStream

pytest.importorskip("rosbags", reason="rosbags is not installed, which reads bags")
pytest.importorskip("PIL", reason="Pillow is not installed, which reads compressed pictures")

ARM = """<robot name="arm"><link name="base"/>
<joint name="lift" type="prismatic"><parent link="base"/><child link="a"/><origin xyz="0 0 0.1"/><axis xyz="0 0 2"/></joint>
<joint name="shoulder" type="revolute"><parent link="a"/><child link="b"/>
<origin xyz="0.1 0 0.2" rpy="0.1 -0.2 0.3"/><axis xyz="0 1 0"/></joint>
<joint name="plate" type="fixed"><parent link="b"/><child link="c"/><origin xyz="0 0.05 0" rpy="1.5707963267948966 0 0"/></joint>
<joint name="wrist" type="continuous"><parent link="c"/><child link="tool0"/><origin xyz="0 0 0.3"/><axis xyz="1 0 1"/></joint>
<joint name="finger" type="prismatic"><parent link="tool0"/><child link="left"/></joint>
<joint name="other_finger" type="prismatic"><parent link="tool0"/><child link="right"/></joint></robot>"""


def arm(lift, shoulder, wrist):
    """By products of rotations written down by hand."""
    x, y, z = np.eye(3)
    turn = rotation(z, 0.3) @ rotation(y, -0.2) @ rotation(x, 0.1)
    return (pose([0, 0, 0.1 + lift]) @ pose([0.1, 0, 0.2], turn) @ pose([0, 0, 0], rotation(y, shoulder))
            @ pose([0, 0.05, 0], rotation(x, np.pi / 2)) @ pose([0, 0, 0.3]) @ pose([0, 0, 0], rotation([1, 0, 1], wrist)))


def joints_at(stop):
    return 0.01 * stop, 0.3 * stop - 0.5, 0.2 - 0.4 * stop


def converted(tmp_path, cell, *words):
    """The folder that a recording becomes."""
    folder = tmp_path / str(len(list(tmp_path.iterdir())))
    folder.mkdir()
    assert main([str(cell.write(folder, "mcap")), "-o", str(folder / "out"), "--quiet", *words]) == 0
    return folder / "out"


def expect_poses(folder, expected):
    rows = np.loadtxt(folder / "poses.tum")
    for row, matrix in zip(rows, expected, strict=True):
        assert np.abs(row[1:4] - matrix[:3, 3]).max() < 1e-9
        assert abs(row[4:] @ fixtures.quaternion(matrix[:3, :3])) > 1 - 1e-12


def still(cell, add):
    """Five places of a second each, at 50 Hz; add(cell, stamp, stop)."""
    for time in range(0, 5000, 20):
        add(cell, START + time * MS, time // 1000)
    return cell


def test_joints_with_the_description_of_the_robot(tmp_path):
    """The tool is the link of a usual name, as two fingers hang on it; the gripper sends messages of its own."""
    def add(cell, stamp, stop):
        cell.add("/joint_states", "sensor_msgs/msg/JointState", stamp, name=["wrist", "lift", "shoulder"],
                 position=[joints_at(stop)[k] for k in (2, 0, 1)])
        cell.add("/joint_states", "sensor_msgs/msg/JointState", stamp + MS, name=["finger"], position=[0.02])
    cell = still(small(poses=False), add)
    cell.add("/robot_description", "std_msgs/msg/String", START, data=ARM)
    expected = [arm(*joints_at(stop)) for stop in range(5)]
    expect_poses(converted(tmp_path, cell), expected)
    cell.entries.pop()
    (tmp_path / "arm.urdf").write_text(ARM)
    expect_poses(converted(tmp_path, cell, "--urdf", str(tmp_path / "arm.urdf"), "--base", "base", "--tool", "tool0"), expected)


def test_joints_that_begin_anew_at_half_a_turn():
    model = robot_model(ARM, "arm.urdf", "base", "tool0")
    stream = JointStream("x", model, [0, 20 * MS], [[0.1, 0, np.pi - 0.02], [0.3, 0, 0.02 - np.pi]])
    assert np.abs(stream.at(5 * MS)[0] - arm(0.15, 0, np.pi - 0.01)).max() < 1e-12


def test_kinematics_from_one_link_to_another():
    model = robot_model(ARM, "arm.urdf", "a", "c")
    assert model.moving == ["shoulder"]
    turn = rotation([0, 0, 1], 0.3) @ rotation([0, 1, 0], -0.2) @ rotation([1, 0, 0], 0.1) @ rotation([0, 1, 0], 0.4)
    middle = pose([0.1, 0, 0.2], turn)
    assert np.abs(model.pose([0.4]) - middle @ pose([0, 0.05, 0], rotation([1, 0, 0], np.pi / 2))).max() < 1e-12


@pytest.mark.parametrize("kind, fields", [
    ("geometry_msgs/msg/PoseStamped", lambda p: {"pose": p}),
    ("geometry_msgs/msg/PoseWithCovarianceStamped", lambda p: {"pose": {"pose": p}}),
    ("franka_msgs/msg/FrankaRobotState", lambda p: {"o_t_ee": {"pose": p}}),
    ("nav_msgs/msg/Odometry", lambda p: {"pose": {"pose": p}}),
    ("geometry_msgs/msg/TransformStamped", lambda p: {"transform": {"translation": p["position"], "rotation": p["orientation"]}})])
def test_topics_of_poses(tmp_path, kind, fields):
    def add(cell, stamp, stop):
        cell.add("/tool", kind, stamp, frame="base", **fields({"position": fixtures.xyz(STOPS[stop][:3, 3]),
                                                               "orientation": fixtures.xyzw(STOPS[stop])}))
    expect_poses(converted(tmp_path, still(small(poses=False), add)), STOPS)


def test_the_matrix_of_a_franka_is_column_by_column(tmp_path):
    def add(cell, stamp, stop):
        cell.add("/franka_state", "franka_msgs/msg/FrankaState", stamp, O_T_EE=STOPS[stop].T.ravel())
    expect_poses(converted(tmp_path, still(small(poses=False), add)), STOPS)


def test_one_pose_a_picture_and_poses_from_a_file(tmp_path):
    """Sparse poses count at their own stamp alone."""
    cell = small(pictures=False, poses=False, infos=False)
    cell.info(COLOUR_INFO, START, LENS)
    lines = []
    for k, stop in enumerate(STOPS):
        stamp = START + k * 2000 * MS
        cell.image(COLOUR, stamp, PIXELS, "rgb8")
        values = map(float, [*stop[:3, 3], *fixtures.quaternion(stop[:3, :3])])
        lines.append(" ".join([f"{stamp // 10**9}.{stamp % 10**9:09d}", *map(repr, values)]))
    (tmp_path / "arm.tum").write_text("# t x y z qx qy qz qw\n" + "\n".join(lines) + "\n")
    expect_poses(converted(tmp_path, cell, "--poses", str(tmp_path / "arm.tum")), STOPS)
    folder = converted(tmp_path, cell, "--without-poses", "--setup", "eye-in-hand", "--target", "chessboard:9x6:0.025")
    names = [f"images/{START // 10**9 + 2 * k}.299000000.png" for k in range(5)]
    assert left(folder) == ["camera_info.yaml", "images", *names, "pairs.csv", "target.json"]


def test_interpolation_is_by_slerp():
    """Between two poses, against an axis and an angle."""
    a, b = pose([0, 0, 0], rotation([1, 2, 3], 0.3)), pose([1, 0, 0], rotation([1, 2, 3], 0.3) @ rotation([0, 1, 1], 1.2))
    quaternions = [fixtures.quaternion(a[:3, :3]), -fixtures.quaternion(b[:3, :3])]
    stream = PoseStream("x", [50 * MS, 100 * MS], [a[:3, 3], b[:3, 3]], quaternions)
    matrix, gap = stream.at(65 * MS)
    assert gap == 50 * MS and np.abs(matrix - fixtures.between(a, b, 0.3)).max() < 1e-12
    assert stream.at(101 * MS + 1) is None and stream.at(48 * MS) is None


def test_quaternions_of_rotations():
    random = np.random.default_rng(1)
    for _ in range(200):
        turn = rotation(random.normal(size=3), random.uniform(0, np.pi))
        found = rigid.quaternion_of(turn)
        assert found[3] >= 0 and np.abs(rigid.rotation_of(found) - turn).max() < 1e-12
        assert abs(found @ fixtures.quaternion(turn)) > 1 - 1e-12


@pytest.mark.parametrize("encoding, pixels, shown", [
    ("rgb8", PIXELS, PIXELS), ("bgr8", PIXELS[:, :, ::-1], PIXELS), ("mono8", PIXELS[:, :, 0], PIXELS[:, :, 0]),
    ("rgba8", np.dstack([PIXELS, PIXELS[:, :, :1]]), PIXELS), ("bgra8", np.dstack([PIXELS[:, :, ::-1], PIXELS[:, :, :1]]), PIXELS)])
def test_encodings(tmp_path, encoding, pixels, shown):
    from PIL import Image
    cell = small(pictures=False)
    for time in picture_times():
        cell.image(COLOUR, time, pixels, encoding, pad=5)
    assert (np.asarray(Image.open(converted(tmp_path, cell) / "images/000003.png")) == shown).all()


@pytest.mark.parametrize("encoding, first", [("bayer_rggb8", (0, 0)), ("bayer_grbg8", (0, 1)), ("bayer_gbrg8", (1, 0)),
                                             ("bayer_bggr8", (1, 1))])
def test_bayer(encoding, first):
    """Planes of one slope come back exactly away from the edge, whatever pixel is red."""
    y, x = np.indices((12, 16))
    colour = np.stack([40 + 2 * x + 4 * y, 30 + 6 * x + 2 * y, 200 - 4 * x - 2 * y], axis=2).astype(np.uint8)
    red = (y % 2 == first[0]) & (x % 2 == first[1])
    blue = (y % 2 != first[0]) & (x % 2 != first[1])
    mosaic = np.where(red, colour[:, :, 0], np.where(blue, colour[:, :, 2], colour[:, :, 1]))
    found = pictures.demosaiced(mosaic, *pictures.BAYER[encoding])
    assert (found[1:-1, 1:-1] == colour[1:-1, 1:-1]).all()


def test_compressed_pictures_stay_what_they_are(tmp_path):
    from PIL import Image
    for form, ending, kind in (("rgb8; jpeg compressed bgr8", "jpg", "JPEG"), ("png", "png", "PNG")):
        file = io.BytesIO()
        Image.fromarray(PIXELS).save(file, kind)
        cell = small(pictures=False)
        for time in picture_times():
            cell.compressed(f"{COLOUR}/compressed", time, file.getvalue(), form)
        assert (converted(tmp_path, cell) / f"images/000000.{ending}").read_bytes() == file.getvalue()


def depth_of(folder, name="depth/000002"):
    from PIL import Image
    path = folder / f"{name}.png"
    return np.asarray(Image.open(path)).astype(np.uint16) if path.exists() else np.load(folder / f"{name}.npy")


def test_depth_as_it_is(tmp_path):
    assert (depth_of(converted(tmp_path, add_depth(small()))) == COUNTS).all()
    metres = COUNTS.astype(np.float32) / 1000
    metres[2, 3], metres[4, 5], metres[1, 1] = np.nan, np.inf, 0
    found = depth_of(converted(tmp_path, add_depth(small(), pixels=metres, encoding="32FC1")))
    assert found.dtype == np.float32 and np.isnan(found).sum() == 3
    assert (found[np.isfinite(found)] == metres[np.isfinite(metres) & (metres > 0)]).all()
    found = depth_of(converted(tmp_path, add_depth(small()), "--depth-scale", "0.00025"))
    assert np.abs(found - COUNTS * 0.00025).max() < 1e-7


def test_depth_of_the_other_byte_order(tmp_path):
    cell = add_depth(small(), pixels=COUNTS.astype(">u2"))
    for entry in cell.entries:
        if entry[0] == DEPTH:
            entry[3]["is_bigendian"] = 1
    assert (depth_of(converted(tmp_path, cell)) == COUNTS).all()


def test_compressed_depth(tmp_path):
    """Counts behind 12 bytes; and inverse depth, a / depth + b, to half a count of that."""
    def recording(form, head, counts):
        cell = small()
        for time in picture_times():
            cell.compressed(f"{DEPTH}/compressedDepth", time, head + fixtures.png16(counts), form)
            cell.info(DEPTH_INFO, time, LENS)
        return cell
    assert (depth_of(converted(tmp_path, recording("16UC1; compressedDepth png", bytes(12), COUNTS))) == COUNTS).all()
    metres = np.linspace(0.4, 5, WIDTH * HEIGHT).reshape(HEIGHT, WIDTH)
    a = 100.0 * 101
    b = 1 - a / 10
    stored = np.rint(a / metres + b)
    stored[0, :3] = 0
    found = depth_of(converted(tmp_path, recording("32FC1; compressedDepth png", struct.pack("<iff", 0, a, b), stored)))
    assert np.isnan(found[0, :3]).all()
    assert np.nanmax(np.abs(found - metres) / metres**2) < 0.5 / a + 1e-7


DEPTH_STREAM, COLOUR_STREAM = "/device_0/sensor_0/Depth_0", "/device_0/sensor_1/Color_0"


def sdk(texts=False, units=None, name="Intel RealSense D435", turn=np.eye(3), depth_lens=LENS, place=(0.015, 0, 0)):
    """What RealSense's own recordings hold: depth in sensor 0, colour in sensor 1, both where p = R p_reference + t. texts: as .db3
    has them; else messages, as .bag has."""
    cell = Cell()

    def add(topic, kind, data, **fields):
        cell.entries.append((topic, kind, START, {"data": data} if data is not None else fields))
    for time in picture_times():
        cell.image(f"{DEPTH_STREAM}/image/data", time, COUNTS, "mono16", "0")
        cell.image(f"{COLOUR_STREAM}/image/data", time, PIXELS, "rgb8", "0")
    text = "std_msgs/msg/String"
    for top, lens, r, t in ((DEPTH_STREAM, depth_lens, np.eye(3), (0, 0, 0)), (COLOUR_STREAM, LENS, turn, place)):
        if texts:
            add(f"{top}/camera_info", text, f"width={WIDTH};height={HEIGHT};fx={lens.fx};ppx={lens.cx};fy={lens.fy};ppy={lens.cy};"
                "model=Inverse Brown Conrady;coeffs=0,0,0,0,0")
            add(f"{top}/tf/ref_0", text, f"rotation={','.join(f'{v:.6f}' for v in r.T.ravel())};translation={','.join(map(str, t))}")
        else:
            cell.info(f"{top}/info/camera_info", 0, lens, "0", START, distortion_model="Inverse Brown Conrady")
            add(f"{top}/tf/0", "geometry_msgs/msg/Transform", None, translation=fixtures.xyz(t),
                rotation=fixtures.xyzw(pose([0, 0, 0], r)))
    if texts:
        add("/device_0/info", text, f"Serial Number=1234;Name={name};Firmware Version=5")
    else:
        add("/device_0/info", "diagnostic_msgs/msg/KeyValue", None, key="Name", value=name)
    if units is not None:
        add("/device_0/sensor_0/option/Depth_Units/value", text if texts else "std_msgs/msg/Float32", f"{units:f}" if texts else units)
    return cell


@pytest.mark.parametrize("texts", [False, True])
@pytest.mark.parametrize("units, name, scale", [(0.001, "Intel RealSense D435", 0.001), (0.0001, "Intel RealSense D405", 0.0001),
                                                (None, "Intel RealSense L515", 0.00025), (None, "Intel RealSense D435", 0.001)])
def test_metres_a_count_of_realsense(tmp_path, units, name, scale, texts):
    """librealsense#8058: .00025 m of an L515. There are no poses in such files."""
    folder = converted(tmp_path, sdk(texts, units, name), "--without-poses", "--topics", f"{DEPTH_STREAM}/image/data", "--for",
                       "segment")
    found = depth_of(folder / "camera1")
    metres = found * 0.001 if found.dtype == np.uint16 else found
    assert np.abs(metres - COUNTS * scale).max() < 1e-7


@pytest.mark.parametrize("texts", [False, True])
def test_depth_is_reprojected_by_realsenses_own_extrinsics(tmp_path, texts):
    """A flat wall: where the colour sees it, it sees its distance, wherever the depth camera saw that pixel."""
    turn = rotation([0, 1, 0], 0.06)
    for changes in ({}, {"turn": turn, "place": (0, 0, 0)}):
        cell = sdk(texts, 0.001, depth_lens=fixtures.lens(WIDTH, HEIGHT, 12.0), **changes)
        for entry in cell.entries:
            if entry[0].endswith("Depth_0/image/data"):
                entry[3]["data"] = np.full(WIDTH * HEIGHT, 1000, "<u2").view(np.uint8)
        found = depth_of(converted(tmp_path, cell, "--without-poses", "--every", "0.5"), f"depth/{START // 10**9}.299000000")
        assert found.dtype == np.float32
        if changes:
            expect_turned_wall(found, turn)
        else:
            # 1 m everywhere but for a column at the edge, 14 x 0.015 px wide, which the depth camera does not reach.
            assert np.nanmax(np.abs(found - 1)) < 1e-6 and np.isnan(found).mean() < 0.1


def test_raw_frames_of_realsense_are_refused_by_name(tmp_path, capsys):
    import sqlite3
    path = sdk(True).write(tmp_path, "db3")
    with sqlite3.connect(path) as database:
        database.execute("UPDATE topics SET type = 'librealsense/raw_frame' WHERE type = 'sensor_msgs/msg/Image'")
    database.close()
    assert main([str(path), "-o", str(tmp_path / "out"), "--without-poses"]) == 2
    assert "rs-convert" in capsys.readouterr().err


def test_reprojection_against_rays(tmp_path):
    """Depth of a tilted plane, seen by a turned camera through lenses with distortion, against rays of the colour camera."""
    depth_lens = Lens(80, 60, 70.0, 71.0, 39.0, 31.0, "plumb_bob", (0.05, -0.02, 0.001, -0.001, 0.0))
    colour_lens = Lens(96, 72, 90.0, 89.0, 47.0, 35.0, "rational_polynomial", (0.1, 0.05, 0.001, 0.0, 0.01, 0.05, 0.02, 0.0))
    matrix = pose([0.02, -0.01, 0.005], rotation([0.2, 1, 0.1], 0.05))
    normal, offset = np.array([0.2, -0.1, 1.0]), 1.1  # in the frame of the depth

    def seen(lens, n, d):
        y, x = np.indices((lens.height, lens.width))
        rays = lens.directions(np.stack([x.ravel(), y.ravel()], axis=1).astype(float))
        assert np.abs(lens.seen(*rays.T) - np.stack([x.ravel(), y.ravel()])).max() < 1e-6
        return (d / (rays @ n[:2] + n[2])).reshape(lens.height, lens.width)
    turned = matrix[:3, :3] @ normal
    expected = seen(colour_lens, turned, offset + turned @ matrix[:3, 3])
    found = alignment.Reprojection(depth_lens, colour_lens, matrix)(seen(depth_lens, normal, offset))
    middle = found[8:-8, 8:-8]
    assert np.isfinite(middle).all()
    # Half a pixel of the depth, and a seam, off in x and in y: each times the slope of depth, z^2 n / offset, over 70 px.
    assert np.abs(middle - expected[8:-8, 8:-8]).max() < 0.6 * (0.2 + 0.1) * expected.max() ** 2 / offset / 70


@pytest.mark.parametrize("kind, columns", [("realsense2_camera_msgs/msg/Extrinsics", True),
                                           ("orbbec_camera_msgs/msg/Extrinsics", False)])
def test_extrinsics_of_drivers(tmp_path, kind, columns):
    """RealSense writes rotations column by column, Orbbec row by row; a wall that is turned tells."""
    turn = rotation([0, 1, 0], 0.06)
    cell = add_depth(small(), frame="depth_optical", pixels=np.full((HEIGHT, WIDTH), 1000, np.uint16))
    cell.add("/camera/extrinsics/depth_to_color", kind, START, translation=[0, 0, 0],
             rotation=(turn.T if columns else turn).ravel())
    expect_turned_wall(depth_of(converted(tmp_path, cell)), turn)


def test_extrinsics_of_static_transforms(tmp_path):
    turn = rotation([0, 1, 0], 0.06)
    cell = add_depth(small(), frame="depth_optical", pixels=np.full((HEIGHT, WIDTH), 1000, np.uint16))
    cell.tf(START, ("link", "camera_optical", pose([0, 0, 0.1], turn.T)), ("link", "depth_optical", pose([0, 0, 0.1])), static=True)
    expect_turned_wall(depth_of(converted(tmp_path, cell)), turn)


def expect_turned_wall(found, turn):
    """Depth of the wall z = 1 m of a camera in whose frame a turned one stands: 1 / (n . ray)."""
    x = (np.arange(WIDTH) - LENS.cx) / LENS.fx
    n = turn @ [0, 0, 1]
    expected = 1 / (n[0] * x + n[2])
    assert np.nanmax(np.abs(found[4:-4, 2:-2] - expected[2:-2])) < 0.06 * 0.8 / LENS.fx + 1e-3


def test_aligned_depth_needs_nothing(tmp_path):
    """By its name, though the frames are two."""
    cell = add_depth(small(), frame="depth_optical", topic="/camera/aligned_depth_to_color/image_raw")
    assert (depth_of(converted(tmp_path, cell)) == COUNTS).all()
    # And before depth that is on other pixels.
    both = add_depth(cell, fixtures.lens(WIDTH, HEIGHT, 12.0), "depth_optical", pixels=COUNTS + 7)
    assert (depth_of(converted(tmp_path, both)) == COUNTS).all()


def test_topics_choose(tmp_path):
    cell = small()
    for time in picture_times():
        cell.image("/other/image_raw", time, PIXELS[::-1], "rgb8", "other")
        cell.info("/other/camera_info", time, LENS, "other")
    from PIL import Image
    for topic, shown in ((COLOUR, PIXELS), ("/other/image_raw", PIXELS[::-1])):
        folder = converted(tmp_path, cell, "--topics", topic)
        assert (np.asarray(Image.open(folder / "images/000000.png")) == shown).all()


def test_lenses():
    """Rational coefficients stay; a rectified picture has none."""
    message = SimpleNamespace(width=64, height=48, k=[50, 0, 31, 0, 51, 22, 0, 0, 1], d=[0.1, 0.2, 0.01, 0.02, 0.3, 0.4, 0.5, 0.6],
                              p=[40, 0, 30, 0, 0, 41, 20, 0, 0, 0, 1, 0], distortion_model="rational_polynomial")
    found = lens_of(message, "x")
    assert found == Lens(64, 48, 50, 51, 31, 22, "rational_polynomial", (0.1, 0.2, 0.01, 0.02, 0.3, 0.4, 0.5, 0.6))
    assert lens_of(message, "x", rectified=True) == Lens(64, 48, 40, 41, 30, 20)
    assert "cols: 8\n  data: [0.1, 0.2, 0.01, 0.02, 0.3, 0.4, 0.5, 0.6]" in found.text()


def orbbec_frame(stamp, encoding, data, metadata=b"", step=2 * WIDTH, newer=True):
    head = struct.pack("<III", 0, stamp // 10**9, stamp % 10**9) + struct.pack("<I", 0) + struct.pack("<II", HEIGHT, WIDTH)
    head += struct.pack("<I", len(encoding)) + encoding.encode() + struct.pack("<BI", 0, step)
    if newer:
        head += struct.pack("<II", len(metadata), len(metadata) + len(data))
        return head + metadata + data + struct.pack("<4Q", 1, 2, 3, 4)
    return head + struct.pack("<I", len(data)) + data


@pytest.mark.parametrize("newer", [True, False])
def test_frames_of_orbbecs_own_recordings(newer):
    """Whose messages are not those of their definitions: with metadata before the pixels and times behind, or without."""
    raw = orbbec_frame(START, "mono16", COUNTS.tobytes(), b"meta" * 5 if newer else b"", newer=newer)
    found = pictures.depth_of(orbbec_sdk.message("/cam/sensor_3/frameType_3", raw, "x"), "x")
    assert found.stamp == START and (found.pixels == COUNTS).all()


def test_a_recording_of_orbbecs_own(tmp_path):
    """Depth on the colour by the profile, whose rotation is row by row and whose place is in millimetres."""
    from PIL import Image
    from rosbags.rosbag1 import Writer
    turn = rotation([0, 1, 0], 0.06)

    def profile(matrix, lens):
        numbers = struct.pack("<12f3H12f", *matrix.ravel(), 0, 0, 0, WIDTH, HEIGHT, 30, lens.fx, lens.fy, lens.cx, lens.cy, *[0] * 8)
        return struct.pack("<IIII", 0, 0, 0, 0) + b"\x03\x01" + numbers + b"\x04"
    file = io.BytesIO()
    Image.fromarray(PIXELS).save(file, "JPEG")
    path = tmp_path / "orbbec.bag"
    with Writer(path) as writer:
        kinds = {"sensor_2/frameType_2": "sensor_msgs/msg/Image", "sensor_3/frameType_3": "sensor_msgs/msg/Image",
                 "streamProfileType_2": "custom_msg/msg/OBStreamProfileInfo",
                 "streamProfileType_3": "custom_msg/msg/OBStreamProfileInfo"}
        topics = {f"/cam/{name}": writer.add_connection(f"/cam/{name}", kind, msgdef="uint8[] data\n", md5sum=32 * "0")
                  for name, kind in kinds.items()}
        writer.write(topics["/cam/streamProfileType_2"], START, profile(np.zeros((3, 3)), LENS))
        writer.write(topics["/cam/streamProfileType_3"], START, profile(turn, fixtures.lens(WIDTH, HEIGHT, 13.0)))
        for stamp in picture_times()[:5]:
            wall = np.full((HEIGHT, WIDTH), 1000, np.uint16).tobytes()
            writer.write(topics["/cam/sensor_3/frameType_3"], stamp + LATE, orbbec_frame(stamp, "mono16", wall, b"m"))
            writer.write(topics["/cam/sensor_2/frameType_2"], stamp + LATE, orbbec_frame(stamp, "mjpg", file.getvalue(), b"m"))
    out = tmp_path / "out"
    assert main([str(path), "-o", str(out), "--without-poses", "--quiet"]) == 0
    assert len(left(out / "images")) == 5 and (out / "images").glob("*.jpg")
    expect_turned_wall(depth_of(out, f"depth/{START // 10**9}.299000000"), turn)


def test_older_files_without_definitions(tmp_path):
    """Of .db3 before ROS 2 Iron."""
    import sqlite3
    path = small().write(tmp_path, "db3")
    with sqlite3.connect(path) as database:
        database.execute("DELETE FROM message_definitions")
    database.close()
    assert main([str(path), "-o", str(tmp_path / "out"), "--quiet"]) == 0
    expect_poses(tmp_path / "out", STOPS)


def test_compressed_files(tmp_path):
    """As rosbag and rosbag2 write them where they are asked to."""
    from rosbags.rosbag1 import Writer as OneWriter
    from rosbags.rosbag2 import CompressionFormat, CompressionMode
    ways = [("ros1", lambda writer, form=form: writer.set_compression(form)) for form in OneWriter.CompressionFormat]
    ways += [(container, lambda writer, mode=mode: writer.set_compression(mode, CompressionFormat.ZSTD))
             for container, mode in (("sqlite_folder", CompressionMode.MESSAGE), ("sqlite_folder", CompressionMode.FILE),
                                     ("mcap_folder", CompressionMode.STORAGE))]
    for number, (container, prepare) in enumerate(ways):
        (tmp_path / str(number)).mkdir()
        path = small().write(tmp_path / str(number), container, prepare)
        assert main([str(path), "-o", str(tmp_path / f"{number}/out"), "--quiet"]) == 0
        expect_poses(tmp_path / f"{number}/out", STOPS)
