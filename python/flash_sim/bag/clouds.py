"""Clouds of points out of PointCloud2."""
import numpy as np

from flash_sim.bag.errors import refusal

TYPES = {7: "f4", 8: "f8"}  # of sensor_msgs/PointField


def points_of(message, where):
    """(n, 3) float32 [m] of the points that are finite, in the frame of the message. Throws RecordingError, which begins with
    `where`, unless it has x, y and z as real numbers."""
    fields = {str(field.name): field for field in message.fields}
    if not all(name in fields and fields[name].datatype in TYPES for name in "xyz"):
        raise refusal(where, f"found a cloud of {', '.join(fields)}, expected x, y and z as real numbers")
    width, height, step = int(message.width), int(message.height), int(message.point_step)
    row, order = int(message.row_step), ">" if message.is_bigendian else "<"
    kind = np.dtype({"names": list("xyz"), "formats": [order + TYPES[fields[name].datatype] for name in "xyz"],
                     "offsets": [fields[name].offset for name in "xyz"], "itemsize": step})
    if row < width * step or len(message.data) < height * row:
        raise refusal(where, f"found {len(message.data)} bytes for {width} x {height} points of {step}, expected {height * row}")
    rows = np.frombuffer(bytes(message.data[:height * row]), np.uint8).reshape(height, row)[:, :width * step]
    records = np.ascontiguousarray(rows).reshape(-1).view(kind)
    points = np.stack([records[name] for name in "xyz"], axis=1).astype(np.float32)
    return points[np.isfinite(points).all(axis=1)]


def ply(points):
    """Bytes of a binary PLY of points (n, 3)."""
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
    return (head + "property float x\nproperty float y\nproperty float z\nend_header\n").encode() + points.astype("<f4").tobytes()
