"""Depth on the pixels of the colour picture, by the extrinsics that the recording itself carries."""
import numpy as np

from flash_sim.bag import orbbec_sdk, realsense, rigid
from flash_sim.bag.errors import refusal

FARTHEST = 1.0    # between two cameras of one device [m]
LARGEST_HOLE = 8  # pixels of the colour that one of the depth may cover, along a side
SEAM = 0.1        # by which neighbours of a slope may part, in pixels of the colour
NEAREST = 1e-3    # of a depth that counts [m]


def colour_from_depth(recording, colour, depth, colour_lens, depth_lens, tree):
    """T_colour_depth (4, 4) of two PictureTopics; None where their pixels are the same. Throws RecordingError where the recording
    does not say how the two cameras stand, or says it by what is no rotation to 1e-3."""
    same = depth_lens == colour_lens
    if same and (depth.frame == colour.frame or depth.aligned):
        return None
    for find in (_realsense_file, _orbbec_file, _extrinsics_topic):
        found = find(recording, colour, depth)
        if found is not None:
            return _checked(recording.path, *found)
    if depth.frame != colour.frame and {depth.frame, colour.frame} <= set(tree.frames):
        way = tree.path_of(colour.frame, depth.frame)
        if way is not None and not any(child in tree.moving_frames for child, _ in way):
            return _checked(recording.path, "/tf_static", tree.chain(colour.frame, depth.frame).at(0)[0])
    raise refusal(recording.path, depth.name,
                  f"found depth {depth_lens.size} px in the frame {depth.frame}, which is not aligned to "
                  f"{colour.name}, {colour_lens.size} px in {colour.frame}, and no extrinsics of the two, expected "
                  "/tf_static or aligned depth; --topics takes one of them alone")


class Reprojection:
    """Pictures of depth as the colour camera would have them.

    Each pixel becomes the rectangle about its four corners; where several fall on a pixel the nearest counts.
    """

    def __init__(self, depth_lens, colour_lens, colour_from_depth):
        """The lenses, and T_colour_depth (4, 4)."""
        self._lens, self._place = colour_lens, colour_from_depth[:3, 3]
        turn = colour_from_depth[:3, :3].T
        self._corners = _rays(depth_lens, depth_lens.height + 1, depth_lens.width + 1, -0.5) @ turn
        self._forward = _rays(depth_lens, depth_lens.height, depth_lens.width, 0) @ turn[:, 2]

    def __call__(self, metres):
        """Depth of the colour camera (h, w) float32 [m], not a number where none falls, of metres (h, w), 0 where nothing was
        measured."""
        height, width = metres.shape
        seen = metres > NEAREST
        z = metres[seen].astype(np.float64)
        depth = z * self._forward[seen] + self._place[2]
        least, most = (np.full((2, len(z)), value) for value in (1e6, -1e6))
        for down in (0, 1):
            for across in (0, 1):
                pixels = self._pixels(self._corners[down:height + down, across:width + across][seen], z)
                np.minimum(least, pixels, out=least)
                np.maximum(most, pixels, out=most)
        return _nearest(self._lens, least, most, depth)

    def _pixels(self, rays, z):
        """(2, n) of the ends of rays (n, 3); far outside where these are behind the camera."""
        x, y, forward = (rays[:, k] * z + self._place[k] for k in range(3))
        behind = forward <= NEAREST
        forward[behind] = 1
        pixels = np.clip(self._lens.seen(x / forward, y / forward), -1e6, 1e6)
        pixels[:, behind] = -1e6
        return pixels


def _nearest(lens, least, most, depth):
    """The picture of rectangles from `least` to `most` (2, n) [px] at depths (n,)."""
    low, high = np.ceil(least - SEAM).astype(np.int64), np.ceil(most + SEAM).astype(np.int64) - 1
    small = high < low  # no centre of a pixel lies in it
    low[small] = high[small] = np.floor((least + most)[small] / 2 + 0.5)
    high = np.minimum(high, low + LARGEST_HOLE - 1)
    nearest = np.full((lens.height, lens.width), np.inf)
    sides = (high - low).max(axis=1) + 1 if len(depth) else (0, 0)
    for across in range(int(sides[0])):
        for down in range(int(sides[1])):
            x, y = low[0] + across, low[1] + down
            inside = (x <= high[0]) & (y <= high[1]) & (x >= 0) & (y >= 0) & (x < lens.width) & (y < lens.height)
            inside &= depth > NEAREST
            np.minimum.at(nearest.reshape(-1), y[inside] * lens.width + x[inside], depth[inside])
    return np.where(np.isfinite(nearest), nearest, np.nan).astype(np.float32)


def _rays(lens, height, width, first):
    """(height, width, 3) with z = 1 of pixels from `first` on."""
    y, x = np.indices((height, width)) + first
    plain = lens.directions(np.stack([x.ravel(), y.ravel()], axis=1))
    return np.concatenate([plain, np.ones((len(plain), 1))], axis=1).reshape(height, width, 3)


def _checked(path, source, matrix):
    """A rigid transform between two cameras of one device."""
    rotation = rigid.expect_rotation(matrix[:3, :3], path, source)
    place = matrix[:3, 3]
    if not np.linalg.norm(place) < FARTHEST:
        raise refusal(path, source,
                      f"found the cameras {np.linalg.norm(place):.4g} m apart, expected less than {FARTHEST:g} m: are "
                      "these millimetres?")
    return rigid.transform(rotation, place)


def _realsense_file(recording, colour, depth):
    """RealSense writes of each stream where its reference is."""
    found = [realsense.reference(recording, picture.base) for picture in (colour, depth)]
    if None in found or found[0][1] != found[1][1]:
        return None
    for name, _, matrix in found:
        rigid.expect_rotation(matrix[:3, :3], recording.path, name)
    return found[1][0], found[0][2] @ rigid.inverse(found[1][2])


def _orbbec_file(recording, colour, depth):
    """Orbbec's SDK writes of the depth where it is in the frame of the colour."""
    name = orbbec_sdk.profile_topic(depth.name)
    if not name or name not in recording.topics or not orbbec_sdk.profile_topic(colour.name):
        return None
    profile = recording.first(name)
    return name, rigid.transform(profile.rotation, profile.translation)


def _extrinsics_topic(recording, colour, depth):
    """Of the ROS drivers: .../depth_to_color; RealSense writes rotations column by column, Orbbec row by row."""
    device = depth.name.split("/")[1:2]
    for topic in recording.topics.values():
        if topic.kind.endswith("/Extrinsics") and "depth_to_color" in topic.name and topic.count:
            if topic.name.split("/")[1:2] != device:
                continue
            message = recording.first(topic.name)
            rotation = np.asarray(message.rotation, np.float64).reshape(3, 3)
            if topic.kind.startswith("realsense"):
                rotation = rotation.T
            return topic.name, rigid.transform(rotation, np.asarray(message.translation, np.float64))
    return None
