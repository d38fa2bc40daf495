"""The pose of the robot's tool over time, from whichever topic tells it."""
import pathlib

import numpy as np

from flash_sim.bag import rigid
from flash_sim.bag.errors import refusal
from flash_sim.bag.pictures import frame_of, stamp_of
from flash_sim.bag.robot_model import robot_model
from flash_sim.bag.streams import PoseStream, bracket, in_order
from flash_sim.bag.transforms import TF_KINDS

POSE_KINDS = ("geometry_msgs/PoseStamped", "geometry_msgs/PoseWithCovarianceStamped", "geometry_msgs/TransformStamped",
              "nav_msgs/Odometry", "franka_msgs/FrankaState", "franka_msgs/FrankaRobotState")
JOINT_KIND, DESCRIPTION = "sensor_msgs/JointState", "robot_description"
BASES = ("base_link", "panda_link0", "fr3_link0", "fer_link0", "link_base", "base", "base_footprint", "world")
TOOLS = ("tcp", "tool0", "panda_hand_tcp", "fr3_hand_tcp", "fer_hand_tcp", "link_tcp", "tool_link", "ee_link", "panda_hand",
         "fr3_hand", "flange", "panda_link8", "fr3_link8", "gripper")
FEW = 12  # names in a message


class JointStream:
    """T_base_tip from joints over time, by the kinematics of the robot; joints are interpolated, then the pose is taken."""

    def __init__(self, source, model, stamps, joints):
        """stamps (n,) [ns], joints (n, len(model.moving)) [rad, m]."""
        self.source, self._model = source, model
        self.times, kept = in_order(stamps)
        self._joints = np.asarray(joints, np.float64)[kept]

    def at(self, time):
        """As PoseStream.at."""
        found = bracket(self.times, time)
        if found is None:
            return None
        before, after, share = found
        way = self._joints[after] - self._joints[before]
        way = np.where(self._model.turning, (way + np.pi) % (2 * np.pi) - np.pi, way)  # an angle may begin anew at half a turn
        return self._model.pose(self._joints[before] + share * way), int(self.times[after] - self.times[before])


def pose_topics(recording, tree, wanted=()):
    """Topics that may tell the robot's pose, those that `wanted` names if it names any. /tf counts where a frame moves; joints
    count where nothing else does."""
    topics = recording.topics.values()
    poses = [topic.name for topic in topics if topic.kind in POSE_KINDS and topic.count]
    moving = [topic.name for topic in topics if topic.kind in TF_KINDS and topic.count and not topic.name.endswith("tf_static")]
    joints = [topic.name for topic in topics if topic.kind == JOINT_KIND and topic.count]
    named = [name for name in (*poses, *moving, *joints) if name in wanted]
    return named or poses + (moving if tree.moving_frames else []) or joints


def read_robot_poses(recording, tree, topics, base="", tool="", urdf=""):
    """The stream of T_base_tool of the one topic of `topics`. base, tool: frames or links; empty: as usual names say. urdf: a file
    of the robot, where the recording has no description. Throws RecordingError where there are several, or none."""
    if not topics:
        raise refusal(recording.path,
                      "found no poses of the robot (/tf with a frame that moves, joint states, PoseStamped, Odometry or "
                      "Franka's state), expected one topic of them: give them by --poses FILE.tum, or leave "
                      "them out by --without-poses")
    if len(topics) > 1:
        raise refusal(recording.path, f"found poses on {', '.join(topics[:FEW])}, expected one: choose by --topics")
    kind = recording.topics[topics[0]].kind
    if kind in TF_KINDS:
        return tree.chain(*_frames(recording.path, tree, base.lstrip("/"), tool.lstrip("/")))
    if kind == JOINT_KIND:
        return _joints(recording, topics[0], base, tool, urdf)
    return _pose_topic(recording, topics[0])


def read_tum(path):
    """The stream of a file of lines `t tx ty tz qx qy qz qw`, seconds and metres. Throws RecordingError naming the line."""
    try:
        lines = pathlib.Path(path).read_text().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise refusal(path, f"cannot be read: {error}") from error
    rows = []
    for number, line in enumerate(lines, 1):
        words = line.split("#")[0].replace(",", " ").split()
        if not words:
            continue
        try:
            whole, _, part = words[0].partition(".")
            stamp = int(whole) * 10**9 + int(part[:9].ljust(9, "0")) if part.isdigit() else int(float(words[0]) * 1e9)
            values = [float(word) for word in words[1:]]
        except ValueError:
            values = []
        if len(values) != 7:
            raise refusal(path, f"line {number}", f"found \"{line[:60]}\", expected t tx ty tz qx qy qz qw")
        where = (path, f"line {number}")
        rows.append((stamp, rigid.place_of(values[:3], *where), rigid.unit_quaternion(values[3:], *where)))
    if not rows:
        raise refusal(path, "found no poses, expected lines t tx ty tz qx qy qz qw")
    return PoseStream(str(path), *zip(*rows))


def _frames(path, tree, base, tool):
    """Base and tool, by their usual names where they are not stated."""
    base = base or next((name for name in BASES if name in tree.frames), "")
    tools = [name for name in TOOLS if name in tree.frames and base and tree.path_of(base, name)]
    tool = tool or (tools[0] if tools else "")
    if base and tool:
        return base, tool
    known = ", ".join(tree.frames[:FEW]) + (" ..." if len(tree.frames) > FEW else "")
    raise refusal(path,
                  f"found no usual name for the robot's {'tool' if base else 'base'} among the frames {known}: state --base "
                  "and --tool")


def _joints(recording, topic, base, tool, urdf):
    model = _model(recording, base, tool, urdf)
    stamps, rows, names = [], [], set()
    for _, message in recording.messages([topic]):
        names.update(map(str, message.name))
        values = dict(zip(map(str, message.name), message.position))
        if all(name in values for name in model.moving):  # a gripper may send messages of its own
            stamps.append(stamp_of(message))
            rows.append([values[name] for name in model.moving])
    where = (recording.path, topic)
    if not rows:
        raise refusal(*where,
                      f"found joints {', '.join(sorted(names))}, expected {', '.join(model.moving)} of the robot's description")
    joints = np.asarray(rows, np.float64)
    if not np.abs(joints).max() < 100:
        raise refusal(*where, f"found a joint at {np.abs(joints).max():.4g}, expected radians and metres")
    return JointStream(f"{topic} {model.base} to {model.tip}", model, stamps, joints)


def _model(recording, base, tool, urdf):
    if urdf:
        try:
            return robot_model(pathlib.Path(urdf).read_text(), urdf, base, tool, TOOLS)
        except (OSError, UnicodeDecodeError) as error:
            raise refusal(urdf, f"cannot be read: {error}") from error
    names = [name for name, topic in recording.topics.items()
             if name.endswith(DESCRIPTION) and topic.kind == "std_msgs/String" and topic.count]
    if not names:
        raise refusal(recording.path, f"found joints and no /{DESCRIPTION}, expected it beside them, or a file: --urdf arm.urdf")
    return robot_model(recording.first(names[0]).data, f"{recording.path}: {names[0]}", base, tool, TOOLS)


def _pose_topic(recording, topic):
    stamps, places, quaternions, frames = [], [], [], set()
    for _, message in recording.messages([topic]):
        where = (recording.path, topic)
        place, quaternion = _pose(message, where)
        stamps.append(stamp_of(message))
        places.append(rigid.place_of(place, *where))
        quaternions.append(rigid.unit_quaternion(quaternion, *where))
        frames.add(frame_of(message))
    if len(frames) != 1:
        raise refusal(recording.path, topic, f"found poses in the frames {', '.join(sorted(frames))}, expected one")
    return PoseStream(topic, stamps, places, quaternions)


def _pose(message, where):
    """Place (3,) and quaternion (4,) of a message of POSE_KINDS."""
    if hasattr(message, "O_T_EE"):  # column by column
        matrix = np.asarray(message.O_T_EE, np.float64).reshape(4, 4).T
        if np.abs(matrix[3] - [0, 0, 0, 1]).max() > rigid.ROTATION_TOLERANCE:
            last = ", ".join(f"{value:.4g}" for value in matrix[3])
            raise refusal(*where, "O_T_EE", f"found the last row {last}, expected 0, 0, 0, 1: was it written row by row?")
        return matrix[:3, 3], rigid.quaternion_of(rigid.expect_rotation(matrix[:3, :3], *where, "O_T_EE"))
    if hasattr(message, "transform"):
        t, r = message.transform.translation, message.transform.rotation
    else:
        pose = message.o_t_ee if hasattr(message, "o_t_ee") else message.pose
        while hasattr(pose, "pose"):
            pose = pose.pose
        t, r = pose.position, pose.orientation
    return (t.x, t.y, t.z), (r.x, r.y, r.z, r.w)
