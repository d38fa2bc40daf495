"""Recordings that the tests write themselves, in every container, with log times that are 80 ms off the stamps of headers."""
import io
import shutil
from types import SimpleNamespace

import numpy as np

SECOND = 10**9
START = 1_764_402_133 * SECOND + 299_000_000  # of a unix clock [ns]
LATE = 80_000_000  # of the log after the header [ns]
EXTRINSICS = "std_msgs/Header header\nfloat64[9] rotation\nfloat64[3] translation\n"
FRANKA = "std_msgs/Header header\nfloat64[16] O_T_EE\n"
FRANKA_TWO = "std_msgs/Header header\ngeometry_msgs/PoseStamped o_t_ee\n"
TF_MESSAGE = "geometry_msgs/TransformStamped[] transforms\n"
CONTAINERS = ("ros1", "sqlite_folder", "mcap_folder", "db3", "mcap")


class Cell:
    """Messages that are not in a container yet, as nested dictionaries of their fields."""

    def __init__(self):
        self.entries = []  # (topic, kind, log time, fields)

    def add(self, topic, kind, stamp, late=LATE, frame="", **fields):
        """One message; its header has the stamp [ns], the log is `late` [ns] after it."""
        header = {"stamp": {"sec": stamp // SECOND, "nanosec": stamp % SECOND}, "frame_id": frame}
        self.entries.append((topic, kind, stamp + late, {"header": header, **fields}))

    def tf(self, stamp, *transforms, static=False, late=LATE):
        """Transforms (parent, child, matrix (4, 4)) of one stamp."""
        items = [{"header": {"stamp": {"sec": stamp // SECOND, "nanosec": stamp % SECOND}, "frame_id": parent},
                  "child_frame_id": child, "transform": {"translation": xyz(matrix[:3, 3]), "rotation": xyzw(matrix)}}
                 for parent, child, matrix in transforms]
        self.entries.append(("/tf_static" if static else "/tf", "tf2_msgs/msg/TFMessage", stamp + late, {"transforms": items}))

    def image(self, topic, stamp, pixels, encoding, frame="camera_optical", late=LATE, pad=0):
        """An Image of pixels (h, w) or (h, w, c); rows end with `pad` bytes of nothing."""
        rows = np.ascontiguousarray(pixels).view(np.uint8).reshape(len(pixels), -1)
        data = np.pad(rows, ((0, 0), (0, pad)), constant_values=7)
        self.add(topic, "sensor_msgs/msg/Image", stamp, late, frame, height=pixels.shape[0], width=pixels.shape[1],
                 encoding=encoding, step=data.shape[1], data=data.ravel())

    def compressed(self, topic, stamp, data, form, frame="camera_optical"):
        self.add(topic, "sensor_msgs/msg/CompressedImage", stamp, LATE, frame, format=form, data=np.frombuffer(data, np.uint8))

    def info(self, topic, stamp, lens, frame="camera_optical", late=LATE, **changes):
        """A CameraInfo of a lens: width, height, fx, fy, cx, cy, d."""
        k = [lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1]
        fields = {"width": lens.width, "height": lens.height, "distortion_model": "plumb_bob", "k": k, "r": np.eye(3).ravel(),
                  "d": list(lens.d), "p": [*k[:3], 0, *k[3:6], 0, *k[6:], 0]}
        self.add(topic, "sensor_msgs/msg/CameraInfo", stamp, late, frame, **(fields | changes))

    def write(self, folder, container, prepare=lambda writer: None):
        """The recording in a container below a folder; its path. prepare: is given the writer before it is opened."""
        entries = sorted(self.entries, key=lambda entry: entry[2])
        if container == "ros1":
            return _write_one(folder / "cell.bag", entries, prepare)
        from rosbags.rosbag2 import StoragePlugin
        mcap = "mcap" in container
        whole = folder / ("mcap_folder" if mcap else "sqlite_folder")
        _write_two(whole, entries, StoragePlugin.MCAP if mcap else StoragePlugin.SQLITE3, prepare)
        if container.endswith("folder"):
            return whole
        lone = folder / f"cell.{container}"
        shutil.copy(next(whole.glob(f"*.{container}")), lone)
        return lone


def lens(width=640, height=480, f=610.0, d=(0, 0, 0, 0, 0)):
    return SimpleNamespace(width=width, height=height, fx=f, fy=f + 1.5, cx=width / 2 - 1.8, cy=height / 2 + 3.6, d=d)


def xyz(v):
    return dict(zip("xyz", map(float, v)))


def xyzw(matrix):
    return dict(zip("xyzw", map(float, quaternion(matrix[:3, :3]))))


def quaternion(rotation):
    """Unit quaternion x y z w of a rotation (3, 3): the eigenvector of the largest eigenvalue (Bar-Itzhack 2000)."""
    r = rotation
    k = np.array([[r[0, 0] - r[1, 1] - r[2, 2], r[1, 0] + r[0, 1], r[2, 0] + r[0, 2], r[2, 1] - r[1, 2]],
                  [r[1, 0] + r[0, 1], r[1, 1] - r[0, 0] - r[2, 2], r[2, 1] + r[1, 2], r[0, 2] - r[2, 0]],
                  [r[2, 0] + r[0, 2], r[2, 1] + r[1, 2], r[2, 2] - r[0, 0] - r[1, 1], r[1, 0] - r[0, 1]],
                  [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], np.trace(r)]]) / 3
    return np.linalg.eigh(k)[1][:, -1]


def rotation(axis, angle):
    """(3, 3) by Rodrigues."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def pose(place, turn=np.eye(3)):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, place
    return matrix


def between(a, b, share):
    """The pose that has gone `share` of the way, by the axis and angle between."""
    turn = a[:3, :3].T @ b[:3, :3]
    angle = np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1))
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    way = rotation(axis, share * angle) if angle > 1e-6 else np.eye(3)
    return pose((1 - share) * a[:3, 3] + share * b[:3, 3], a[:3, :3] @ way)


def draw_board(camera, T_camera_board, columns=9, rows=6, square=0.025, samples=3):
    """(h, w) uint8 of a chessboard of so many inner corners; its frame has x right, y down, z into the board."""
    u, v = np.meshgrid(np.arange(camera.width * samples), np.arange(camera.height * samples))
    u, v = ((grid + 0.5) / samples - 0.5 for grid in (u, v))
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.shape)], axis=2)
    normal, origin = T_camera_board[:3, 2], T_camera_board[:3, 3]
    points = rays * (normal @ origin / (rays @ normal))[:, :, None] - origin
    x, y = points @ T_camera_board[:3, 0] / square + 1, points @ T_camera_board[:3, 1] / square + 1
    inside = (x >= 0) & (x < columns + 1) & (y >= 0) & (y < rows + 1)
    dark = inside & ((np.floor(x) + np.floor(y)) % 2 == 0)
    paper = (x >= -1) & (x < columns + 2) & (y >= -1) & (y < rows + 2)
    bright = np.where(dark, 40.0, np.where(paper, 215.0, 120.0))
    return np.rint(bright.reshape(camera.height, samples, camera.width, samples).mean(axis=(1, 3))).astype(np.uint8)


def png16(counts):
    """Bytes of a PNG of 16 bits, by Pillow."""
    from PIL import Image
    file = io.BytesIO()
    Image.fromarray(counts.astype(np.uint16)).save(file, "PNG")
    return file.getvalue()


def built(store, kind, fields):
    """A message of rosbags; what is not given is zero or empty. ROS 1 writes some names in capitals."""
    from rosbags.interfaces import Nodetype
    values = {}
    for name, (node, what) in store.fielddefs[kind][1]:
        value = fields.get(name, fields.get(name.lower()))
        if node == Nodetype.NAME:
            values[name] = built(store, what, value or {})
        elif node == Nodetype.BASE:
            values[name] = value if value is not None else ("" if what[0] == "string" else 0)
        else:
            (item, item_kind), count = what
            if item == Nodetype.NAME:
                values[name] = [built(store, item_kind, entry) for entry in value or []]
            elif item_kind[0] == "string":
                values[name] = list(value or [])
            else:
                kind_of = {"octet": "uint8"}.get(item_kind[0], item_kind[0])
                values[name] = np.asarray(value if value is not None else [0] * count, kind_of)
    return store.types[kind](**values)


def _store(name):
    from rosbags.typesys import get_types_from_msg, get_typestore
    store = get_typestore(name)
    for kind, text in (("realsense2_camera_msgs/msg/Extrinsics", EXTRINSICS), ("orbbec_camera_msgs/msg/Extrinsics", EXTRINSICS),
                       ("franka_msgs/msg/FrankaState", FRANKA), ("franka_msgs/msg/FrankaRobotState", FRANKA_TWO),
                       ("tf2_msgs/msg/TFMessage", TF_MESSAGE)):
        if kind not in store.fielddefs:
            store.register(get_types_from_msg(text, kind))
    return store


def _write(writer, store, serialize, entries):
    """All entries, a connection a topic."""
    connections = {}
    with writer:
        for topic, kind, time, fields in entries:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], time, serialize(built(store, kind, fields), kind))


def _write_one(path, entries, prepare):
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores
    store, writer = _store(Stores.ROS1_NOETIC), Writer(path)
    prepare(writer)
    _write(writer, store, store.serialize_ros1, entries)
    return path


def _write_two(path, entries, plugin, prepare):
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores
    store, writer = _store(Stores.ROS2_HUMBLE), Writer(path, version=9, storage_plugin=plugin)
    prepare(writer)
    _write(writer, store, store.serialize_cdr, entries)
