"""Recordings of Orbbec's own SDK: ROS 1 bags whose messages are not those that their definitions say.

Frames are on /cam/sensor_N/frameType_N, lenses and extrinsics on /cam/streamProfileType_N, with N = 2 for colour and 3 for depth.
"""
import re
import struct
from types import SimpleNamespace

import numpy as np

from flash_sim.bag.errors import refusal

FRAMES = re.compile(r"/cam/sensor_(\d+)/frameType_\d+")
PROFILES = re.compile(r"/cam/streamProfileType_(\d+)")
FISHEYE = 5  # OBCameraDistortionModel


def writes(topic):
    """Whether messages of such a topic are read here."""
    return bool(FRAMES.fullmatch(topic) or PROFILES.fullmatch(topic))


def profile_topic(frames):
    """The topic with the lens of a topic of frames; None of any other topic."""
    match = FRAMES.fullmatch(frames)
    return match and f"/cam/streamProfileType_{match[1]}"


def message(topic, raw, where):
    """A picture with the fields of sensor_msgs/Image, or a profile with those of CameraInfo, `rotation` (3, 3) and
    `translation` (3,) [m], both from this stream's frame to that of the colour. Throws RecordingError."""
    try:
        return _frame(raw) if FRAMES.fullmatch(topic) else _profile(raw)
    except (struct.error, UnicodeDecodeError) as error:
        raise refusal(where, f"found a message of {len(raw)} bytes that is cut off, expected one of the Orbbec SDK") from error


class _Bytes:
    def __init__(self, raw):
        self.raw, self.at = raw, 0

    def take(self, form):
        values = struct.unpack_from("<" + form, self.raw, self.at)
        self.at += struct.calcsize("<" + form)
        return values if len(values) > 1 else values[0]

    def text(self):
        size = self.take("I")
        return struct.unpack(f"{size}s", self.block(size))[0].decode()

    def block(self, size):
        if size > len(self.raw) - self.at:
            raise struct.error
        self.at += size
        return self.raw[self.at - size:self.at]

    def header(self):
        _, sec, nanosec = self.take("III")
        return SimpleNamespace(stamp=SimpleNamespace(sec=sec, nanosec=nanosec), frame_id=self.text())


def _frame(raw):
    rest = _Bytes(raw)
    header = rest.header()
    height, width = rest.take("II")
    encoding, big_endian, step = rest.text(), rest.take("B"), rest.take("I")
    # Newer ones say how many bytes of metadata come before the pixels, and end with four times.
    start, metadata = rest.at, rest.take("I")
    size = rest.take("I")
    if size + 32 == len(raw) - rest.at and metadata <= size:
        data = rest.block(size)[metadata:]
    else:
        rest.at = start
        data = rest.block(rest.take("I"))
    if encoding.lower() in ("mjpg", "jpeg", "jpg"):
        return SimpleNamespace(header=header, format="jpeg", data=np.frombuffer(data, np.uint8))
    return SimpleNamespace(header=header, height=height, width=width, encoding=encoding.lower(), is_bigendian=big_endian, step=step,
                           data=np.frombuffer(data, np.uint8))


def _profile(raw):
    rest = _Bytes(raw)
    header = rest.header()
    rest.take("BB")
    rotation = np.array(rest.take("9f"), np.float64).reshape(3, 3)
    translation = np.array(rest.take("3f"), np.float64) * 1e-3
    width, height, _ = rest.take("3H")
    fx, fy, cx, cy = rest.take("4f")
    k1, k2, k3, k4, k5, k6, p1, p2 = rest.take("8f")
    model = "kannala_brandt4" if rest.take("B") == FISHEYE else "rational_polynomial"
    return SimpleNamespace(header=header, width=width, height=height, k=[fx, 0, cx, 0, fy, cy, 0, 0, 1], p=[0.0] * 12,
                           d=[k1, k2, p1, p2, k3, k4, k5, k6], distortion_model=model, rotation=rotation,
                           translation=translation)
