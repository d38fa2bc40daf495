"""Depth on the pixels of the colour picture, by the extrinsics that the recording itself carries."""
import re

import numpy as np

from flash_sim.bag import orbbec_sdk, rigid
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
    raise refusal(recording.path, depth.name, f"found depth {depth_lens.size} px in the frame {depth.frame}, which is not aligned to "
                  f"{colour.name}, {colour_lens.size} px in {colour.frame}, and no extrinsics of the two, expected "
                  "/tf_static or aligned depth; --topics takes one of them alone")


def reprojected(metres, depth_lens, colour_lens, colour_from_depth):
    """Depth of the colour camera (h, w) float32 [m], not a number where none falls.

    metres: (h, w), 0 or not a number where nothing was measured. Each pixel becomes the rectangle about its four corners;
    where several fall on a pixel the nearest counts.
    """
    y, x = np.nonzero(metres > NEAREST)
    z = metres[y, x].astype(np.float64)
    corners = [_seen(np.stack([x + across, y + down], axis=1), z, depth_lens, colour_lens, colour_from_depth)
               for across in (-0.5, 0.5) for down in (-0.5, 0.5)]
    depth = sum(corner[1] for corner in corners) / 4
    least, most = (pick.reduce([corner[0] for corner in corners]) for pick in (np.minimum, np.maximum))
    low, high = np.ceil(least - SEAM).astype(np.int64), np.ceil(most + SEAM).astype(np.int64) - 1
    small = high < low  # no centre of a pixel lies in it
    low[small] = high[small] = np.floor((least + most)[small] / 2 + 0.5)
    high = np.minimum(high, low + LARGEST_HOLE - 1)
    nearest = np.full((colour_lens.height, colour_lens.width), np.inf)
    size = (high - low).max(axis=0) + 1 if len(z) else (0, 0)
    for across in range(int(size[0])):
        for down in range(int(size[1])):
            at = low + [across, down]
            inside = ((at <= high) & (at >= 0) & (at < [colour_lens.width, colour_lens.height])).all(axis=1) & (depth > NEAREST)
            np.minimum.at(nearest, (at[inside, 1], at[inside, 0]), depth[inside])
    return np.where(np.isfinite(nearest), nearest, np.nan).astype(np.float32)


def _seen(pixels, z, depth_lens, colour_lens, matrix):
    """Pixels (n, 2) and depth (n,) in the colour of pixels of the depth; what is behind the camera stands at no pixel."""
    points = np.concatenate([depth_lens.directions(pixels), np.ones((len(z), 1))], axis=1) * z[:, None]
    points = points @ matrix[:3, :3].T + matrix[:3, 3]
    before = points[:, 2] > NEAREST
    seen = np.full((len(z), 2), -1e6)
    seen[before] = np.clip(colour_lens.project(points[before]), -1e6, 1e6)
    return seen, points[:, 2]


def _checked(path, source, matrix):
    """A rigid transform between two cameras of one device."""
    rotation = rigid.expect_rotation(matrix[:3, :3], path, source)
    place = matrix[:3, 3]
    if not np.linalg.norm(place) < FARTHEST:
        raise refusal(path, source, f"found the cameras {np.linalg.norm(place):.4g} m apart, expected less than {FARTHEST:g} m: are "
                                    "these millimetres?")
    return rigid.transform(rotation, place)


def _realsense_file(recording, colour, depth):
    """RealSense writes of each stream where its reference is: p_stream = R p_reference + t."""
    tops = [re.sub(r"/image/data$", "/tf/", picture.base) for picture in (colour, depth)]
    names = [next((name for name in recording.topics if name.startswith(top) and top.endswith("/tf/")), None) for top in tops]
    if None in names or names[0].rsplit("/", 1)[1] != names[1].rsplit("/", 1)[1]:
        return None
    matrices = []
    for name in names:
        message = recording.first(name)
        t, r = message.translation, message.rotation
        quaternion = rigid.unit_quaternion((r.x, r.y, r.z, r.w), recording.path, name)
        matrices.append(rigid.transform(rigid.rotation_of(quaternion), (t.x, t.y, t.z)))
    return names[1], matrices[0] @ rigid.inverse(matrices[1])


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
