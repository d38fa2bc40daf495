"""The folder that `flash-calib handeye` reads: pictures, the robot's pose at each, the lens, and depth where there is one."""
import json
from dataclasses import dataclass, replace

import numpy as np

from flash_sim.bag import camera as cameras
from flash_sim.bag import streams
from flash_sim.bag.errors import refusal
from flash_sim.bag.robot_motion import poses_at, stops, tum

FEWEST_STOPS = 4  # views that handeye needs


@dataclass(frozen=True)
class Views:
    """The pictures that are kept."""

    stamps: np.ndarray  # (n,) of the pictures [ns]
    names: list         # of their files, without ending
    poses: str | None   # text of poses.tum


def write_hand_eye(recording, camera, stream, folder, settings, said):
    """Writes the data set into a StagedFolder; how many pictures. stream: of T_base_tool, None: poses are left out. settings: those
    of the command line. Throws RecordingError."""
    if camera.colour is None:
        raise refusal(recording.path,
                      "found no pictures (sensor_msgs/Image or CompressedImage of eight bits), expected those of a target")
    pairs = cameras.paired_depth(recording.path, camera, said)
    name = camera.colour.name
    stamps = camera.stamps[name].times
    if pairs is not None:
        said.left_out(name, int((~pairs.belong).sum()), "have no depth within half a frame")
        camera = replace(camera, stamps={**camera.stamps, name: replace(camera.stamps[name], times=stamps[pairs.belong])})
    cameras.compare_infos(recording.path, camera, said)
    views = _views(recording.path, camera, stream, settings, said)
    depth_of = _depth_stamps(camera, pairs, stamps, views)
    _write_pictures(recording, camera, views, depth_of, folder)
    folder.write("camera_info.yaml", cameras.lens_text(camera, settings.camera_info))
    if views.poses is not None:
        folder.write("poses.tum", views.poses)
    target = {key: value for key, value in (("setup", settings.setup), ("target", settings.target)) if value}
    if target:
        folder.write("target.json", json.dumps(target) + "\n")
    folder.write("pairs.csv", _pairs_text(views, depth_of, stream))
    return len(views.stamps)


def _views(path, camera, stream, settings, said):
    """Which pictures to keep: one of each stop; or, every so often, those of a moving arm with the poses over time."""
    name, stamps = camera.colour.name, camera.stamps[camera.colour.name].times
    if stream is None:
        chosen = _thinned(stamps, settings.every or 0)
        return Views(chosen, [streams.seconds(stamp) for stamp in chosen], None)
    poses, inside = poses_at(path, stream, stamps, name)
    said.left_out(name, int((~inside).sum()), f"lie outside of {stream.source}")
    stamps = stamps[inside]
    if settings.every is not None:
        chosen = _thinned(stamps, settings.every)
        times = stream.times
        text = tum([streams.seconds(time) for time in times], [stream.at(int(time))[0] for time in times])
        return Views(chosen, [streams.seconds(stamp) for stamp in chosen], text)
    chosen = _of_stops(path, stream, stamps, poses, settings, said)
    text = tum([str(number) for number in range(len(chosen))], poses[chosen])
    return Views(stamps[chosen], [f"{number:06d}" for number in range(len(chosen))], text)


def _of_stops(path, stream, stamps, poses, settings, said):
    """Indices of one picture of each stop, at most `views` of them, evenly."""
    found = stops(stream, stamps, poses)
    if len(found) < FEWEST_STOPS:
        raise refusal(path,
                      f"found {len(found)} places at which the robot of {stream.source} stands still for 0.4 s while a picture is "
                      f"taken, expected at least {FEWEST_STOPS}; --every 0.5 takes pictures of a moving arm")
    chosen = [stop[len(stop) // 2] for stop in found]
    said(f"the robot stands still at {len(found)} places, of {len(stamps)} pictures")
    if settings.views and settings.views < len(chosen):
        chosen = [chosen[round(k)] for k in np.linspace(0, len(chosen) - 1, settings.views)]
    return chosen


def _thinned(stamps, seconds):
    """Those that are at least so far apart."""
    chosen, least = [], round(seconds * streams.SECOND)
    for stamp in stamps:
        if not chosen or stamp - chosen[-1] >= least:
            chosen.append(int(stamp))
    return np.asarray(chosen, np.int64)


def _depth_stamps(camera, pairs, stamps, views):
    """The stamp of the depth of each view, by the stamp of the view; empty without depth."""
    if pairs is None:
        return {}
    depth = camera.stamps[camera.depth.name].times
    index = np.searchsorted(stamps, views.stamps)
    return {int(stamp): int(depth[pairs.nearest[k]]) for stamp, k in zip(views.stamps, index)}


def _write_pictures(recording, camera, views, depth_of, folder):
    names = dict(zip(map(int, views.stamps), views.names))
    depth_names = {}
    for stamp, depth in depth_of.items():
        depth_names.setdefault(depth, []).append(names[stamp])
    wanted = {camera.colour.name: set(names)}
    if depth_names:
        wanted[camera.depth.name] = set(depth_names)
    for topic, picture in cameras.pictures(recording, camera, wanted):
        if topic == camera.colour.name:
            folder.write(f"images/{names[picture.stamp]}.{picture.ending}", picture.file)
        else:
            ending, file = cameras.depth_file(camera, picture)
            for name in depth_names[picture.stamp]:
                folder.write(f"depth/{name}.{ending}", file)


def _pairs_text(views, depth_of, stream):
    """What each view was put together from."""
    lines = ["picture,t,depth_skew_ms,pose_gap_ms"]
    for stamp, name in zip(map(int, views.stamps), views.names):
        skew = f"{(depth_of[stamp] - stamp) * 1e-6:.3f}" if depth_of else ""
        gap = f"{stream.at(stamp)[1] * 1e-6:.3f}" if stream is not None else ""
        lines.append(f"{name},{streams.seconds(stamp)},{skew},{gap}")
    return "\n".join(lines) + "\n"
