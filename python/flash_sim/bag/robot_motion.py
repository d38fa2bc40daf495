"""When the robot stands still, and where it is when pictures are taken."""
import numpy as np

from flash_sim.bag import rigid, streams
from flash_sim.bag.errors import refusal

STILL_WINDOW = (-0.2, -0.1, 0.1, 0.2)            # looked at about a picture [s]
STILL_PLACE, STILL_TURN = 0.5e-3, np.radians(0.1)  # what still is within it [m], [rad]
STOP_PLACE, STOP_TURN = 2e-3, np.radians(0.5)    # beyond which it is another stop


def poses_at(path, stream, stamps, name):
    """(transforms (n, 4, 4), which of the stamps have one (m,) bool) at the stamps [ns] of a topic. Throws RecordingError where a
    stamp falls into a gap of more than 0.1 s between poses, and where clocks differ."""
    if not len(stream.times):
        raise refusal(path, stream.source,
                      "found a tool that stands still on the base, expected a frame that moves between: state --base "
                      "and --tool")
    streams.expect_one_clock(path, name, stamps, stream.source, stream.times)
    found = [stream.at(int(stamp)) for stamp in stamps]
    inside = np.array([pose is not None for pose in found])
    if not inside.any():
        raise refusal(path, f"found no picture of {name} at a time of {stream.source}")
    for stamp, pose in zip(stamps, found):
        if pose is not None and pose[1] > streams.LARGEST_GAP:
            raise refusal(path, stream.source,
                          f"found a gap of {pose[1] * 1e-9:.3g} s between poses about {streams.seconds(stamp)} s, "
                          "expected at most 0.1 s; --from and --until cut it off")
    return np.array([pose[0] for pose in found if pose is not None]), inside


def stops(stream, stamps, poses):
    """Lists of the indices of pictures of each place at which the robot stands still, in order of time. stamps (n,) [ns], poses
    (n, 4, 4) there."""
    found = []
    last = None
    for index, (stamp, pose) in enumerate(zip(stamps, poses)):
        if not is_still(stream, int(stamp), pose):
            last = None
        elif last is not None and _near(poses[last], pose, STOP_PLACE, STOP_TURN):
            found[-1].append(index)
        else:
            found.append([index])
            last = index
    return found


def is_still(stream, stamp, pose):
    """Whether the robot, which is at `pose` at a stamp [ns], is there 0.2 s before and after."""
    for shift in STILL_WINDOW:
        other = stream.at(stamp + round(shift * streams.SECOND))
        if other is not None and other[1] <= streams.LARGEST_GAP and not _near(pose, other[0], STILL_PLACE, STILL_TURN):
            return False
    return True


def tum(stamps, poses):
    """The text of a file of poses; stamps: texts, one a pose (4, 4)."""
    lines = ["# t tx ty tz qx qy qz qw"]
    for stamp, pose in zip(stamps, poses):
        values = [*pose[:3, 3], *rigid.quaternion_of(pose[:3, :3])]
        lines.append(" ".join([stamp, *(f"{value:.12g}" for value in values)]))
    return "\n".join(lines) + "\n"


def _near(a, b, place, turn):
    return np.linalg.norm(a[:3, 3] - b[:3, 3]) <= place and rigid.turn_between(a[:3, :3], b[:3, :3]) <= turn
