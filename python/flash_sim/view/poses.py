"""Poses over time, as files have them."""
import numpy as np

from flash_sim.bag.rigid import rotation_of, slerp, transform


def matrix_of(pose):
    """(4, 4) of x y z qx qy qz qw."""
    quaternion = np.asarray(pose[3:7], float)
    return transform(rotation_of(quaternion / np.linalg.norm(quaternion)), np.asarray(pose[:3], float))


def pose_at(rows, time):
    """(4, 4) at a time, between rows (n, 8) of t x y z qx qy qz qw; before the first and after the last it rests."""
    after = int(np.clip(np.searchsorted(rows[:, 0], time), 0, len(rows) - 1))
    before = max(after - 1, 0)
    if before == after or time >= rows[after, 0]:
        return matrix_of(rows[after, 1:])
    share = max((time - rows[before, 0]) / (rows[after, 0] - rows[before, 0]), 0.0)
    place = (1 - share) * rows[before, 1:4] + share * rows[after, 1:4]
    return matrix_of([*place, *slerp(rows[before, 4:], rows[after, 4:], share)])
