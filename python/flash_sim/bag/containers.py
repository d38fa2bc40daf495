"""The files that recordings come in: ROS 1 bags, rosbag2 folders, lone .db3 and .mcap files."""
import contextlib
import pathlib
from dataclasses import dataclass

from flash_sim.bag import orbbec_sdk
from flash_sim.bag.errors import RecordingError, refusal

# What cannot be read here, and what makes folders of it.
OF_VENDORS = {
    ".svo": ("a ZED recording", "python svo_export.py --mode 4 --input_svo_file {} --output_path_dir FOLDER"),
    ".svo2": ("a ZED recording", "python svo_export.py --mode 4 --input_svo_file {} --output_path_dir FOLDER"),
    ".mkv": ("an Azure Kinect recording", "ffmpeg -i {} -map 0:1 -vsync 0 FOLDER/depth/%06d.png"),
    ".zdf": ("a Zivid frame", "python convert_zdf.py --ply {}"),
}
# Beside those of ROS, for files that carry no definitions, as the older .db3.
EXTRINSICS = "std_msgs/Header header\nfloat64[9] rotation\nfloat64[3] translation\n"
DEFINITIONS = {"realsense2_camera_msgs/msg/Extrinsics": EXTRINSICS, "orbbec_camera_msgs/msg/Extrinsics": EXTRINSICS,
               "tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms\n"}


@dataclass(frozen=True)
class Topic:
    """A stream of messages of one type."""

    name: str
    kind: str   # the type, as "sensor_msgs/Image"
    count: int  # of messages


class Recording:
    """An open recording; a context manager. Messages come in the order of their log times, which nothing else is made of."""

    def __init__(self, path):
        """Throws RecordingError, one line, where the file is not there or is none that can be read."""
        self.path = str(path)
        self._stack = contextlib.ExitStack()
        try:
            self._open(pathlib.Path(path))
        except BaseException:
            self._stack.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._stack.close()

    @property
    def topics(self):
        """All Topics by name, in order of name."""
        return self._topics

    def messages(self, names):
        """(topic name, message) of these topics. Throws RecordingError of what is damaged or of an unknown type."""
        for topic, _, message in self.logged_messages(names):
            yield topic, message

    def logged_messages(self, names):
        """(topic name, log time [ns], message), likewise."""
        names = set(names)
        wanted = [connection for connection in self._reader.connections if connection.topic in names]
        if not wanted:
            return
        topic = ""
        with _told(self.path):
            for connection, time, raw in self._reader.messages(connections=wanted):
                topic = connection.topic
                with _told(self.path, topic):
                    message = self._message(connection, bytes(raw))
                yield topic, int(time), message

    def first(self, name):
        """The first message of a topic. Throws RecordingError where there is none."""
        for _, message in self.messages([name]):
            return message
        raise refusal(self.path, name, "found no message, expected those that the index tells of: the file is damaged")

    def _open(self, path):
        path = readable(path)
        try:
            from rosbags.rosbag1 import Reader as RosOneReader
            from rosbags.rosbag2 import Reader as RosTwoReader
            from rosbags.typesys import Stores, get_types_from_msg, get_typestore
        except ImportError as error:
            raise RecordingError(f"{self.path}: found no package {error.name}, which reads bags, expected it beside flash_sim: "
                                 "pip install 'flash-sim[bag]'") from error
        self._is_one = path.suffix == ".bag"
        with _told(self.path):
            self._reader = (RosOneReader if self._is_one else RosTwoReader)(path)
            self._reader.open()
        self._stack.callback(self._reader.close)
        self._known = get_typestore(Stores.ROS1_NOETIC if self._is_one else Stores.LATEST)
        for kind, definition in DEFINITIONS.items():
            if kind not in self._known.fielddefs:
                self._known.register(get_types_from_msg(definition, kind))
        self._told_types = get_typestore(Stores.EMPTY)
        with _told(self.path):
            self._learn_types()
            found = {name: Topic(name, info.connections[0].msgtype.replace("/msg/", "/"), info.msgcount)
                     for name, info in self._reader.topics.items()}
        self._topics = {name: found[name] for name in sorted(found)}

    def _learn_types(self):
        """Takes the definitions that the file carries; each type once. Those that cannot be understood, or lack a field of ROS's own,
        are damaged: then that of ROS holds."""
        from rosbags.interfaces import MessageDefinitionFormat
        from rosbags.typesys import TypesysError, get_types_from_idl, get_types_from_msg
        for connection in self._reader.connections:
            definition = connection.msgdef
            try:
                if definition.format == MessageDefinitionFormat.MSG:
                    types = get_types_from_msg(definition.data, connection.msgtype)
                elif definition.format == MessageDefinitionFormat.IDL:
                    types = get_types_from_idl(_idl(definition.data))
                else:
                    continue
                new = {name: fields for name, fields in types.items()
                       if name not in self._told_types.fielddefs and not self._lacks_fields(name, fields)}
                self._told_types.register(new)
            except TypesysError:  # of a topic that may never be asked for
                continue

    def _lacks_fields(self, name, definition):
        known = self._known.fielddefs.get(name, ((), ()))[1]
        return not {field.lower() for field, _ in known} <= {field.lower() for field, _ in definition[1]}

    def _message(self, connection, raw):
        if orbbec_sdk.writes(connection.topic):
            return orbbec_sdk.message(connection.topic, raw, f"{self.path}: {connection.topic}")
        kind = connection.msgtype
        store = next((store for store in (self._told_types, self._known) if kind in store.fielddefs), None)
        if store is None:
            raise refusal(self.path, connection.topic, f"found messages of type {kind} without their definition, expected a file "
                                                       "that carries it, as .mcap or .bag do")
        return store.deserialize_ros1(raw, kind) if self._is_one else store.deserialize_cdr(raw, kind)


def readable(path):
    """The file or folder to open for `path`. Throws RecordingError, with what to do, where it is no recording."""
    name, ending = str(path), path.suffix.lower()
    if not path.exists():
        raise refusal(name, "no such file or folder")
    if ending in OF_VENDORS:
        what, command = OF_VENDORS[ending]
        raise refusal(name, f"is {what}, which is not read; the vendor's tool exports it: {command.format(name)}")
    if path.is_dir():
        return _in_folder(path)
    if name.endswith(".bag.active"):
        raise refusal(name, "was not closed and has no index: rename it to .bag, then run rosbag reindex on it")
    if not path.is_file():
        raise refusal(name, "is a device, a pipe or a socket, expected a file")
    if ending not in (".bag", ".db3", ".mcap"):
        raise refusal(name, f"found the ending \"{ending}\", expected .bag, .db3, .mcap or the folder of a rosbag2")
    return path


def _in_folder(path):
    if (path / "metadata.yaml").is_file():
        return path
    files = sorted(file for file in path.iterdir() if file.suffix in (".db3", ".mcap"))
    if len(files) == 1:
        return files[0]
    if files:
        raise refusal(path, f"found {len(files)} files of a rosbag2 without metadata.yaml: run ros2 bag reindex {path}")
    raise refusal(path, "found no metadata.yaml, no .db3 and no .mcap, expected the folder of a rosbag2")


def _idl(text):
    """One definition of what may be several, each under a line of equal signs."""
    line = "=" * 80 + "\n"
    return "\n".join(part.split("\n", 1)[1] for part in text.split(line) if part.startswith("IDL: ")) or text


@contextlib.contextmanager
def _told(path, topic=""):
    """Turns what a reader throws, of whatever type, into one line."""
    try:
        yield
    except (RecordingError, GeneratorExit, KeyboardInterrupt):
        raise
    except OSError as error:
        raise refusal(path, topic, f"cannot be read: {error.strerror or error}") from error
    except Exception as error:  # struct.error, AssertionError, sqlite errors: whatever damaged bytes lead to
        line = " ".join(str(error).split()) or type(error).__name__
        if "not indexed" in line or "index looks damaged" in line:
            raise refusal(path, f"found no index, as after a crash: run rosbag reindex {path}") from error
        raise refusal(path, topic, f"cannot be read, it is damaged or cut off: {line}") from error
