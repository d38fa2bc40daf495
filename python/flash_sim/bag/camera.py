"""A camera of a recording: its topics, its lens, when its pictures were taken, and its pictures one by one."""
import io
import pathlib
import re
from dataclasses import dataclass, replace

import numpy as np

from flash_sim.bag import alignment, choice, png, realsense, streams
from flash_sim.bag.arrival import LARGEST_DELAY
from flash_sim.bag.errors import refusal
from flash_sim.bag.lens import Lens, expect_size, lens_of
from flash_sim.bag.pictures import depth_of, frame_of, picture_of, stamp_of
from flash_sim.bag.realsense import MILLIMETRES

# One of them is in each file of intrinsics that flash-calib reads.
LENS_WORDS = re.compile(r"matrix|mtx|intrinsic|focal|camera|\bfx\b|\bk\b", re.IGNORECASE)


@dataclass(frozen=True)
class Stamps:
    """When the messages of a topic were stamped."""

    times: np.ndarray  # (n,) of the headers [ns], in order
    delay: int         # from there to the log, in the middle [ns]


@dataclass(frozen=True)
class Camera:
    """Colour, depth or both, on the same pixels."""

    colour: choice.PictureTopic | None
    depth: choice.PictureTopic | None
    lens: Lens | None              # of the colour where there is one; None where a file of one's own has it
    depth_lens: Lens | None        # of the depth as it is recorded
    align: alignment.Reprojection | None  # of depth that is on other pixels
    scale: float                   # [m] a count of the depth
    stamps: dict                   # of each topic its Stamps
    info_stamps: dict              # of each topic those of its camera_info

    @property
    def main(self):
        """The topic whose stamps count."""
        return self.colour or self.depth


def open_camera(recording, colour, depth, tree, scale=None, own_lens=False):
    """The Camera of two PictureTopics, either of which may be None. scale: [m] a count, None: as the recording says. own_lens: a
    file has the lens. Throws RecordingError."""
    lenses, info_stamps = {}, {}
    for picture in filter(None, (colour, depth)):
        found = (None, Stamps(np.empty(0, np.int64), 0)) if own_lens else _lens(recording, picture)
        lenses[picture.name], info_stamps[picture.name] = found
    align = None
    if colour and depth and own_lens and not (depth.aligned or depth.frame == colour.frame):
        raise refusal(recording.path, depth.name,
                      f"found depth in the frame {depth.frame} beside {colour.name} in {colour.frame} and one "
                      "--camera-info, expected aligned depth; --topics takes one of them alone")
    if colour and depth and not own_lens:
        pair = lenses[colour.name], lenses[depth.name]
        matrix = alignment.colour_from_depth(recording, colour, depth, *pair, tree)
        align = None if matrix is None else alignment.Reprojection(*pair[::-1], matrix)
    if depth and scale is None:
        scale = realsense.depth_scale(recording, depth.name)
    stamps = _stamps(recording, [picture for picture in (colour, depth) if picture])
    return Camera(colour, depth, lenses[(colour or depth).name], lenses[depth.name] if depth else None, align, scale or MILLIMETRES,
                  stamps, info_stamps)


def between(path, camera, start, end):
    """The camera with pictures from `start` to `end` only, seconds since the first; None: all. Throws RecordingError where there is
    none."""
    main = camera.main.name
    stamps = camera.stamps[main]
    return replace(camera, stamps={**camera.stamps, main: replace(stamps, times=streams.cut(path, main, stamps.times, start, end))})


def pictures(recording, camera, wanted):
    """(topic name, Picture or DepthPicture) of the stamps in `wanted`, a set for each topic, as they come. Depth is checked against
    its lens. Throws RecordingError where one cannot be read or has another size than those before."""
    sizes = {}
    for topic, message in recording.messages([name for name, stamps in wanted.items() if len(stamps)]):
        if stamp_of(message) not in wanted[topic]:
            continue
        where = f"{recording.path}: {topic}"
        is_depth = camera.depth is not None and topic == camera.depth.name
        found = depth_of(message, where) if is_depth else picture_of(message, where)
        size = found.pixels.shape[::-1] if is_depth else (found.width, found.height)
        if sizes.setdefault(topic, size) != size:
            raise refusal(where, f"found pictures of {_size(size)} after {_size(sizes[topic])}, expected one resolution")
        lens = camera.depth_lens if is_depth else camera.lens
        if lens is not None:
            expect_size(lens, *size, where)
        yield topic, found


def depth_file(camera, depth):
    """(ending, bytes) of a DepthPicture on the pixels of the camera: PNG of counts where these are millimetres and nothing is
    reprojected, else metres as numpy writes them."""
    if depth.counts and camera.align is None and camera.scale == MILLIMETRES:
        return "png", png.encoded(depth.pixels)
    metres = depth.pixels * camera.scale if depth.counts else depth.pixels
    metres = np.where(np.isfinite(metres) & (metres > 0), metres, np.nan)
    if camera.align is not None:
        metres = camera.align(np.nan_to_num(metres))
    file = io.BytesIO()
    np.save(file, metres.astype(np.float32))
    return "npy", file.getvalue()


def lens_text(camera, path):
    """Of camera_info.yaml: that of the camera, or of a file of one's own."""
    if camera.lens is not None:
        return camera.lens.text()
    try:
        text = pathlib.Path(path).read_text()
    except (OSError, UnicodeDecodeError) as error:
        raise refusal(path, f"cannot be read: {error}") from error
    if not LENS_WORDS.search(text):
        raise refusal(path, "found no lens, expected a camera_info, or another file of intrinsics that flash-calib reads")
    return text


def paired_depth(path, camera, said):
    """Pairs of the colour with the depth; None without both. Says the skew. Throws RecordingError where most are too far apart."""
    if not (camera.colour and camera.depth):
        return None
    return _paired(path, camera.stamps[camera.colour.name], camera.stamps[camera.depth.name], camera.colour.name, camera.depth.name,
                   said)


def compare_infos(path, camera, said):
    """Says the skew of pictures and their camera_info, where that comes as often. Throws RecordingError beyond half a frame."""
    for picture in filter(None, (camera.colour, camera.depth)):
        stamps, infos = camera.stamps[picture.name], camera.info_stamps[picture.name]
        if len(infos.times) > 1 and len(infos.times) >= 0.8 * picture.count:
            _paired(path, stamps, infos, picture.name, "its camera_info", said)


def _paired(path, stamps, others, name, other, said):
    streams.expect_one_clock(path, name, stamps.times, other, others.times)
    if abs(stamps.delay - others.delay) > LARGEST_DELAY:
        apart = (stamps.delay - others.delay) * 1e-9
        raise refusal(path, f"{name} and {other}", f"found stamps that are {apart:+.3f} s apart for what arrived together, expected one "
                                                   "clock: what was seen at one time is not known")
    pairs = streams.paired(stamps.times, others.times)
    said(pairs.text(name, other))
    if pairs.belong.mean() < 0.5:
        middle = np.median(np.abs(pairs.skew)) * 1e-6
        raise refusal(path, f"{name} and {other}", f"found stamps {middle:.1f} ms apart, expected less than half a frame, "
                                                   f"{pairs.half_frame * 1e-6:.1f} ms: what was seen at one time is not known")
    return pairs


def _lens(recording, picture):
    """The lens of a PictureTopic, the same in all messages, and their stamps."""
    topic = choice.info_topic(recording, picture)
    where = f"{recording.path}: {topic}"
    lens, stamps, delays = None, [], []
    for _, time, message in recording.logged_messages([topic]):
        message = realsense.camera_info(message, where)
        found = lens_of(message, where, picture.rectified)
        if lens not in (None, found):
            raise refusal(where,
                          f"found two lenses (fx {lens.fx:.6g} and {found.fx:.6g}, {lens.size} and {found.size} px), expected one "
                          "all the time")
        lens = found
        stamps.append(stamp_of(message))
        delays.append(time - stamps[-1])
    if lens is None:
        raise refusal(where, "found no message, expected those that the index tells of: the file is damaged")
    return lens, Stamps(np.unique(stamps), int(np.median(delays)))


def _stamps(recording, wanted):
    """Of each topic the Stamps of its pictures."""
    found, delays = {picture.name: [] for picture in wanted}, {picture.name: [] for picture in wanted}
    frames = {picture.name: picture.frame for picture in wanted}
    for topic, time, message in recording.logged_messages(found):
        if frame_of(message) != frames[topic]:
            raise refusal(recording.path, topic,
                          f"found pictures in the frames {frames[topic]} and {frame_of(message)}, expected one")
        found[topic].append(stamp_of(message))
        delays[topic].append(time - found[topic][-1])
    for topic, stamps in found.items():
        if not any(stamps):
            raise refusal(recording.path, topic,
                          "found the stamp 0 in every header, expected the time at which a picture was taken")
        if len(set(stamps)) < len(stamps):
            raise refusal(recording.path, topic,
                          f"found {len(stamps) - len(set(stamps))} pictures with the stamp of another, expected "
                          "one a stamp: was the bag recorded while it was played, or twice?")
    return {topic: Stamps(np.sort(np.asarray(stamps, np.int64)), int(np.median(delays[topic]))) for topic, stamps in found.items()}


def _size(size):
    return f"{size[0]} x {size[1]}"
