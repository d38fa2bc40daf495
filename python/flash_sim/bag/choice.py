"""Which topics of a recording are taken: pictures, depth, clouds, and the lens that belongs to each."""
from dataclasses import dataclass

from flash_sim.bag import orbbec_sdk, realsense
from flash_sim.bag.errors import refusal
from flash_sim.bag.pictures import BAYER, COLOURS, encoding_of, frame_of, is_depth

PICTURE_KINDS = ("sensor_msgs/Image", "sensor_msgs/CompressedImage")
INFO_KIND, CLOUD_KIND = "sensor_msgs/CameraInfo", "sensor_msgs/PointCloud2"
TRANSPORTS = ("compressed", "compressedDepth", "theora", "zstd", "ffmpeg")
ALIGNED = ("aligned_depth", "depth_to_color", "depth_to_rgb", "depth_registered")


@dataclass(frozen=True)
class PictureTopic:
    """A topic of pictures, as its first message has it."""

    name: str
    count: int
    depth: bool
    encoding: str
    frame: str  # of the camera

    @property
    def base(self):
        """The topic without what its transport adds to the name."""
        parts = self.name.split("/")
        return "/".join(parts[:-1] if parts[-1] in TRANSPORTS else parts)

    @property
    def coloured(self):
        """Whether its pictures are no grey ones, as far as the encoding says."""
        return self.encoding.split(";")[0] in {*COLOURS, *BAYER} or not self.encoding.startswith("mono")

    @property
    def rectified(self):
        """Whether its name says so."""
        return any("rect" in part.split("_") for part in self.base.split("/")[-2:])

    @property
    def aligned(self):
        """Whether the name of a topic of depth says that it has the pixels of the colour."""
        return any(word in self.name for word in ALIGNED)


def survey(recording):
    """The PictureTopics of a recording that have messages, in order of name. Throws RecordingError of RealSense's raw ones."""
    found = []
    for topic in recording.topics.values():
        if topic.kind == realsense.RAW_KIND:
            raise refusal(recording.path, topic.name, "found raw frames of an early RealSense .db3, which its SDK alone reads, expected "
                                                      f"pictures: rs-convert -i {recording.path} -p FOLDER/ writes them")
        if topic.count and (topic.kind in PICTURE_KINDS or orbbec_sdk.FRAMES.fullmatch(topic.name)):
            message = recording.first(topic.name)
            depth = is_depth(message, topic.name)
            found.append(PictureTopic(topic.name, topic.count, depth, encoding_of(message), frame_of(message)))
    return found


def choose_pictures(path, pictures, wanted=()):
    """(colour, depth) of PictureTopics, each None where there is none; if `wanted` names some, of these alone.

    Of several a raw topic comes before its compressed twin, colour before grey, aligned depth before the other. Throws
    RecordingError where two are left.
    """
    named = [picture for picture in pictures if picture.name in wanted]
    candidates = named or pictures
    colour = _one(path, _preferred([p for p in candidates if not p.depth], lambda p: p.coloured), "pictures")
    depth = _one(path, _preferred([p for p in candidates if p.depth], lambda p: p.aligned), "depth")
    return colour, depth


def choose_cloud(recording, wanted=()):
    """The name of the topic of clouds, or None. Throws RecordingError where there are several."""
    names = [topic.name for topic in recording.topics.values() if topic.kind == CLOUD_KIND and topic.count]
    names = [name for name in names if name in wanted] or names
    if len(names) > 1:
        raise refusal(recording.path, f"found clouds on {', '.join(names)}, expected one: choose by --topics")
    return names[0] if names else None


def expect_topics(recording, wanted):
    """Throws RecordingError where a topic is asked for that is not there."""
    for name in wanted:
        if name not in recording.topics:
            raise refusal(recording.path, f"found no topic {name}, expected one of those that --list shows")


def info_topic(recording, picture):
    """The name of the topic that has the lens of a PictureTopic. Throws RecordingError where there is none."""
    base = picture.base
    parent = base.rsplit("/", 1)[0]
    names = [orbbec_sdk.profile_topic(picture.name), f"{parent}/camera_info", f"{base}/camera_info"]
    names += realsense.info_topics(base)
    for name in names:
        if name in recording.topics and recording.topics[name].count:
            return name
    infos = [topic.name for topic in recording.topics.values() if topic.kind == INFO_KIND and topic.count]
    alike = [name for name in infos if frame_of(recording.first(name)) == picture.frame]
    if len(alike) == 1:
        return alike[0]
    raise refusal(recording.path, picture.name,
                  f"found no camera_info of it{' but ' + ', '.join(infos) if infos else ''}, expected "
                  f"{parent}/camera_info: record it, or name a file by --camera-info")


def _preferred(pictures, better):
    """Raw ones before their compressed twins; of the rest the better ones, where there are any."""
    raw = {picture.base for picture in pictures if picture.base == picture.name}
    left = [picture for picture in pictures if picture.base == picture.name or picture.base not in raw]
    return [picture for picture in left if better(picture)] or left


def _one(path, pictures, what):
    if len(pictures) > 1:
        raise refusal(path, f"found {what} on {', '.join(p.name for p in pictures)}, expected one topic: choose by --topics")
    return pictures[0] if pictures else None
