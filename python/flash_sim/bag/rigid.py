"""Rotations and rigid transforms.

A transform is a matrix (4, 4), T_parent_child, that maps points of the child into the parent [m]. A quaternion is (4,), x y z w.
"""
import numpy as np

from flash_sim.bag.errors import refusal

ROTATION_TOLERANCE = 1e-3  # of R^T R - 1, and of the length of a quaternion


def transform(rotation, place):
    """(4, 4) of a rotation (3, 3) and a place (3,)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, place
    return matrix


def inverse(matrix):
    """Of a rigid transform (4, 4)."""
    rotation = matrix[:3, :3].T
    return transform(rotation, -rotation @ matrix[:3, 3])


def rotation_of(quaternion):
    """(3, 3) of a unit quaternion x y z w."""
    x, y, z, w = quaternion
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def quaternion_of(rotation):
    """x y z w of a rotation (3, 3), w not below 0 (Shepperd 1978: by the largest of the four)."""
    r, trace = rotation, np.trace(rotation)
    largest = int(np.argmax([*np.diag(r), trace]))
    if largest == 3:
        q = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], 1 + trace])
    else:
        i, j, k = largest, (largest + 1) % 3, (largest + 2) % 3
        q = np.empty(4)
        q[i], q[3] = 1 + 2 * r[i, i] - trace, r[k, j] - r[j, k]
        q[j], q[k] = r[j, i] + r[i, j], r[k, i] + r[i, k]
    q /= np.linalg.norm(q)
    return -q if q[3] < 0 else q


def slerp(before, after, share):
    """The unit quaternion that has gone `share` of the shorter way."""
    cosine = float(np.dot(before, after))
    if cosine < 0:
        after, cosine = -after, -cosine
    if cosine > 1 - 1e-12:
        mixed = before + share * (after - before)
    else:
        angle = np.arccos(cosine)
        mixed = (np.sin((1 - share) * angle) * before + np.sin(share * angle) * after) / np.sin(angle)
    return mixed / np.linalg.norm(mixed)


def unit_quaternion(values, *where):
    """x y z w of length 1. Throws RecordingError, which begins with `where`, where it is off by more than 1e-3."""
    quaternion = np.asarray(values, np.float64)
    length = float(np.linalg.norm(quaternion))
    if not abs(length - 1) <= ROTATION_TOLERANCE:
        raise refusal(*where, f"found a quaternion of length {length:.6g}, expected 1")
    return quaternion / length


def place_of(values, *where):
    """(3,) [m]. Throws RecordingError where it is not finite, or no place of a robot's cell."""
    place = np.asarray(values, np.float64)
    if not np.abs(place).max() < 1e3:  # not a number is refused as well
        raise refusal(*where, f"found a place at {', '.join(f'{value:.6g}' for value in place)}, expected metres within 1 km")
    return place


def expect_rotation(rotation, *where):
    """The nearest rotation to a matrix (3, 3). Throws RecordingError with the number unless it is one to 1e-3."""
    off = float(np.abs(rotation.T @ rotation - np.eye(3)).max())
    if not off <= ROTATION_TOLERANCE or np.linalg.det(rotation) < 0:
        raise refusal(*where, f"found a matrix that is {off:.3g} off a rotation (R(0,0) = {rotation[0, 0]:.6g}, determinant "
                              f"{np.linalg.det(rotation):.6g}), expected a rotation to {ROTATION_TOLERANCE:g}")
    left, _, right = np.linalg.svd(rotation)
    return left @ right


def turn_between(a, b):
    """The angle between two rotations (3, 3) [rad]."""
    axis = a.T @ b
    sine = 0.5 * np.linalg.norm([axis[2, 1] - axis[1, 2], axis[0, 2] - axis[2, 0], axis[1, 0] - axis[0, 1]])
    return float(np.arctan2(sine, 0.5 * (np.trace(axis) - 1)))
