"""The folder that `flash-sysid segment` reads: depth or clouds of one camera, their times, and the gripper's way."""
import json

import numpy as np

from flash_sim.bag import camera as cameras
from flash_sim.bag import clouds, rigid, streams
from flash_sim.bag.errors import refusal
from flash_sim.bag.pictures import frame_of, stamp_of
from flash_sim.bag.robot_motion import poses_at, tum
from flash_sim.bag.robot_poses import BASES

VIEW = "camera1"


def write_lift(recording, camera, stream, tree, folder, settings, said):
    """Writes depth, colour where there is one, times and the gripper into a StagedFolder; how many frames. stream: of
    T_base_gripper, None: it is left out. Throws RecordingError."""
    if camera.depth is None:
        raise refusal(recording.path,
                      "found no depth (sensor_msgs/Image of 16UC1 or 32FC1, or compressedDepth), expected that of a lift")
    pairs = cameras.paired_depth(recording.path, camera, said)
    cameras.compare_infos(recording.path, camera, said)
    colour_stamps = camera.stamps[camera.main.name].times
    belong = pairs.belong if pairs else np.ones(len(colour_stamps), bool)
    depth_stamps = camera.stamps[camera.depth.name].times[pairs.nearest] if pairs else colour_stamps
    said.left_out(camera.main.name, int((~belong).sum()), "have no depth within half a frame")
    frames = dict(zip(map(int, depth_stamps[belong]), map(int, colour_stamps[belong])))
    times = np.array(sorted(frames), np.int64)
    times = _write_gripper(recording.path, stream, times, camera.depth.name, folder, said)
    names = {int(time): f"{number:06d}" for number, time in enumerate(times)}
    _write_frames(recording, camera, names, {frames[int(time)]: names[int(time)] for time in times}, folder)
    folder.write(f"{VIEW}/camera_info.yaml", cameras.lens_text(camera, settings.camera_info))
    _write_place(recording.path, camera.main.frame, tree, settings, folder, said)
    return len(times)


def write_clouds(recording, topic, stream, tree, folder, settings, said):
    """Likewise of a topic of clouds, which are left in the frame of their camera."""
    stamps, frames = [], set()
    for _, message in recording.messages([topic]):
        stamps.append(stamp_of(message))
        frames.add(frame_of(message))
    if len(frames) != 1:
        raise refusal(recording.path, topic, f"found clouds in the frames {', '.join(sorted(frames))}, expected one")
    times = streams.cut(recording.path, topic, np.unique(np.asarray(stamps, np.int64)), settings.start, settings.end)
    times = _write_gripper(recording.path, stream, times, topic, folder, said)
    names = {int(time): f"{number:06d}" for number, time in enumerate(times)}
    for _, message in recording.messages([topic]):
        if stamp_of(message) in names:
            points = clouds.points_of(message, f"{recording.path}: {topic}")
            folder.write(f"{VIEW}/{names[stamp_of(message)]}.ply", clouds.ply(points))
    if not _write_place(recording.path, frames.pop(), tree, settings, folder, said):
        raise refusal(recording.path, topic,
                      "found clouds in a frame whose place on the base is not known, expected --extrinsics FILE")
    return len(times)


def _write_gripper(path, stream, times, name, folder, said):
    """times.csv and gripper.tum; the times [ns] that have a pose."""
    if stream is not None:
        _, inside = poses_at(path, stream, times, name)
        said.left_out(name, int((~inside).sum()), f"lie outside of {stream.source}")
        times = times[inside]
        moves = stream.times
        folder.write("gripper.tum", tum([streams.seconds(time) for time in moves], [stream.at(int(time))[0] for time in moves]))
    folder.write("times.csv", "t\n" + "".join(f"{streams.seconds(time)}\n" for time in times))
    return times


def _write_frames(recording, camera, names, colour_names, folder):
    wanted = {camera.depth.name: set(names)}
    if camera.colour:
        wanted[camera.colour.name] = set(colour_names)
    for topic, picture in cameras.pictures(recording, camera, wanted):
        if topic == camera.depth.name:
            ending, file = cameras.depth_file(camera, picture)
            folder.write(f"{VIEW}/depth/{names[picture.stamp]}.{ending}", file)
        else:
            folder.write(f"{VIEW}/color/{colour_names[picture.stamp]}.{picture.ending}", picture.file)


def _write_place(path, frame, tree, settings, folder, said):
    """Where the camera is: a file of one's own, or the transforms of the recording where they say that it stands still."""
    if settings.extrinsics:
        name = "extrinsics.tum" if settings.extrinsics.endswith(".tum") else "extrinsics.json"
        try:
            with open(settings.extrinsics, "rb") as file:
                folder.write(f"{VIEW}/{name}", file.read())
        except OSError as error:
            raise refusal(settings.extrinsics, f"cannot be read: {error.strerror}") from error
        return True
    base = settings.base.lstrip("/") or next((name for name in BASES if name in tree.frames), "")
    way = tree.path_of(base, frame) if {base, frame} <= set(tree.frames) else None
    if way is None or any(child in tree.moving_frames for child, _ in way):
        said(f"where {frame} is on the robot's base is not recorded: give segment --extrinsics camera.json, of flash-calib handeye")
        return False
    matrix = tree.chain(base, frame).at(0)[0]
    transform = {"parent": base, "child": frame, "translation": matrix[:3, 3].tolist(),
                 "rotation_xyzw": rigid.quaternion_of(matrix[:3, :3]).tolist()}
    folder.write(f"{VIEW}/extrinsics.json", json.dumps({"schema": "flash-extrinsics/2", "transform": transform}, indent=1) + "\n")
    said(f"the camera is where /tf_static puts {frame} on {base}; calibrate it for millimetres")
    return True
