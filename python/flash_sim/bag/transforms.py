"""The transforms of /tf and /tf_static, chained from one frame to another."""
import numpy as np

from flash_sim.bag import rigid
from flash_sim.bag.errors import refusal
from flash_sim.bag.streams import FixedPose, PoseProduct, PoseStream

TF_KINDS = ("tf2_msgs/TFMessage", "tf/tfMessage")


class TransformTree:
    """Frames that hang on each other, with their transforms over time."""

    def __init__(self, path):
        """path: of the recording, for messages."""
        self._path = path
        self._parents = {}  # by child
        self._moving = {}   # by child: topic, stamps, places, quaternions
        self._fixed = {}    # by child: T_parent_child

    def add(self, topic, stamp, parent, child, place, quaternion, static):
        """One transform T_parent_child. Throws RecordingError: a quaternion that is not unit, a frame that hangs on two others, or
        one that stands still and moved."""
        parent, child = parent.lstrip("/"), child.lstrip("/")
        where = (self._path, topic, f"{parent} to {child}")
        quaternion = rigid.unit_quaternion(quaternion, *where)
        place = rigid.place_of(place, *where)
        if self._parents.setdefault(child, parent) != parent:
            raise refusal(self._path, topic, f"found {child} on {self._parents[child]} and on {parent}, expected one parent")
        if static:
            matrix = rigid.transform(rigid.rotation_of(quaternion), place)
            if np.abs(self._fixed.setdefault(child, matrix) - matrix).max() > 1e-6:
                raise refusal(*where, "found two transforms that differ, expected one that stands still")
        else:
            _, stamps, places, quaternions = self._moving.setdefault(child, (topic, [], [], []))
            stamps.append(stamp)
            places.append(place)
            quaternions.append(quaternion)

    @property
    def frames(self):
        """All names, in order."""
        return sorted({*self._parents, *self._parents.values()})

    @property
    def moving_frames(self):
        """Those whose transform to their parent is sent over time, in order."""
        return sorted(self._moving)

    def path_of(self, base, tool):
        """[(child frame, whether the way goes up from it)] from the base to the tool; None where no way leads there."""
        up, down = self._to_root(base), self._to_root(tool)
        common = next((frame for frame in up if frame in down), None)
        if common is None:
            return None
        rising = [(frame, True) for frame in up[:up.index(common)]]
        return rising + [(frame, False) for frame in reversed(down[:down.index(common)])]

    def chain(self, base, tool):
        """The stream of T_base_tool. Throws RecordingError where a frame is unknown, or no way leads from one to the other."""
        for frame in (base, tool):
            if frame not in self.frames:
                raise refusal(self._path,
                              f"found no frame {frame} in /tf or /tf_static, expected one of {', '.join(self.frames)}")
        way = self.path_of(base, tool)
        if way is None:
            raise refusal(self._path, f"found no chain of transforms from {base} to {tool}: {base} hangs on "
                                      f"{self._to_root(base)[-1]}, {tool} on {self._to_root(tool)[-1]}")
        return PoseProduct(f"/tf {base} to {tool}", [(self._stream(child), rises) for child, rises in way])

    def _stream(self, child):
        if child in self._fixed:
            return FixedPose(self._fixed[child])
        topic, *samples = self._moving[child]
        return PoseStream(f"{topic} {self._parents[child]} to {child}", *samples)

    def _to_root(self, frame):
        way = [frame]
        while way[-1] in self._parents and self._parents[way[-1]] not in way:
            way.append(self._parents[way[-1]])
        return way


def read_transforms(recording):
    """The TransformTree of all topics of transforms; those whose name ends in tf_static stand still."""
    from flash_sim.bag.pictures import stamp_of
    tree = TransformTree(recording.path)
    names = [topic.name for topic in recording.topics.values() if topic.kind in TF_KINDS]
    for topic, message in recording.messages(names):
        for item in message.transforms:
            t, r = item.transform.translation, item.transform.rotation
            tree.add(topic, stamp_of(item), item.header.frame_id, item.child_frame_id, (t.x, t.y, t.z), (r.x, r.y, r.z, r.w),
                     topic.endswith("tf_static"))
    return tree
