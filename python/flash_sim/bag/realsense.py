"""Recordings of RealSense's own SDK, on topics /device_N/sensor_N/STREAM_N/...

Those of ROS 1 have messages of ROS. Those of ROS 2 (.db3) have pictures of ROS, and texts "name=value;name=value" for the rest.
"""
import re
from types import SimpleNamespace

import numpy as np

from flash_sim.bag import rigid
from flash_sim.bag.errors import refusal

STREAM = re.compile(r"(/device_\d+/sensor_\d+/\w+_\d+)/image/data")
RAW_KIND = "librealsense/raw_frame"  # of the first .db3 files, in early 2026
MILLIMETRES = 0.001
# Cameras whose counts are no millimetres, where no option says so [m].
BY_NAME = {"L515": 0.00025, "D405": 0.0001}


def info_topics(base):
    """Names that the lens of a topic of pictures may be under; none of another topic."""
    match = STREAM.fullmatch(base)
    return [f"{match[1]}/{rest}" for rest in ("info/camera_info", "image/camera_info", "camera_info")] if match else []


def camera_info(message, where):
    """A text about a lens with the fields of CameraInfo; any other message as it is. Throws RecordingError."""
    if not isinstance(getattr(message, "data", None), str):
        return message
    fields = _fields(message.data)
    try:
        fx, fy, cx, cy = (float(fields[name]) for name in ("fx", "fy", "ppx", "ppy"))
        header = SimpleNamespace(stamp=SimpleNamespace(sec=0, nanosec=0), frame_id="")
        return SimpleNamespace(header=header, width=int(fields["width"]), height=int(fields["height"]), d=_numbers(fields["coeffs"]),
                               k=[fx, 0, cx, 0, fy, cy, 0, 0, 1], p=[0.0] * 12, distortion_model=fields["model"])
    except (KeyError, ValueError) as error:
        raise refusal(where, f"found \"{message.data[:60]}\", expected width, height, fx, fy, ppx, ppy, model and coeffs") from error


def reference(recording, base):
    """(topic, name of the reference, T_stream_reference (4, 4)) of a topic of pictures; None where it is not recorded. Throws
    RecordingError."""
    match = STREAM.fullmatch(base)
    top = f"{match[1]}/tf/" if match else None
    name = next((name for name in recording.topics if top and name.startswith(top)), None)
    if name is None:
        return None
    message = recording.first(name)
    if hasattr(message, "data"):
        fields = _fields(message.data)
        rotation, place = (_numbers(fields.get(key, "")) for key in ("rotation", "translation"))
        if len(rotation) != 9 or len(place) != 3:
            raise refusal(recording.path, name, f"found \"{message.data[:60]}\", expected a rotation of 9 numbers and a translation of 3")
        return name, name.removeprefix(top), rigid.transform(rotation.reshape(3, 3).T, place)  # column by column
    t, r = message.translation, message.rotation
    quaternion = rigid.unit_quaternion((r.x, r.y, r.z, r.w), recording.path, name)
    return name, name.removeprefix(top), rigid.transform(rigid.rotation_of(quaternion), (t.x, t.y, t.z))


def depth_scale(recording, topic):
    """Metres a count of a topic of depth: the option Depth Units, else by the camera's name, else millimetres; so are the counts of
    ROS. Throws RecordingError where the option is no scale."""
    sensor = re.match(r"(/device_\d+)/sensor_\d+", topic)
    if not sensor:
        return MILLIMETRES
    for name in recording.topics:
        if re.fullmatch(re.escape(sensor[0]) + "/option/depth[ _]units/value", name, re.IGNORECASE):
            return _scale(recording.first(name).data, recording.path, name)
    for _, message in recording.messages([f"{sensor[1]}/info"]):
        text = message.data if hasattr(message, "data") else f"{message.key}={message.value}"
        camera = _fields(text).get("Name", "")
        for model, scale in BY_NAME.items():
            if model in camera:
                return scale
    return MILLIMETRES


def _scale(text, *where):
    try:
        value = float(f"{float(text):.6g}")  # of a float32
    except ValueError:
        value = float("nan")
    if not 1e-6 < value < 0.1:
        raise refusal(*where, f"found {text} m a count, expected as 0.001")
    return value


def _fields(text):
    return dict(part.split("=", 1) for part in text.split(";") if "=" in part)


def _numbers(text):
    return np.array([float(word) for word in text.split(",") if word.strip()], np.float64)
