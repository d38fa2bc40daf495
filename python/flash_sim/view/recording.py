"""What was seen of an object over time, what held it, and where the cameras stand."""
import pathlib
from dataclasses import dataclass

import numpy as np

from flash_sim import _core
from flash_sim.bag.errors import refusal
from flash_sim.view import page
from flash_sim.view.depth import Camera, points_of
from flash_sim.view.drawn import Arrow, Points, put
from flash_sim.view.poses import matrix_of, pose_at
from flash_sim.view.tables import read_json, read_table

WRITER = "flash-sysid import or synth"
MOST_POINTS = 20_000  # that are drawn of a keyframe
SAME_TIME = 1e-6  # [s]


@dataclass(frozen=True, eq=False)
class Recording:
    """Keyframes in order of time; places are in the base frame [m], times by the clock of the recording [s]."""

    name: str
    times: np.ndarray  # (n,)
    clouds: list       # (k, 3) each
    counts: list       # points of each, of which a cloud may have a part
    forces: list       # (3,) of the gripper [N] each, or None
    tracks: dict       # rows t x y z qx qy qz qw of each gripper by its name
    grasps: list       # (gripper, from, to) each
    cameras: list      # Camera each

    def held_by(self, gripper, time):
        """Whether a gripper holds the object."""
        return any(name == gripper and start <= time <= end for name, start, end in self.grasps)


def load_recording(folder, camera_folders=()):
    """The Recording of a folder. camera_folders: each with camera_info.yaml and extrinsics.json of a camera that is drawn too.

    Throws RecordingError, or ValueError of a file, in one line that names it.
    """
    folder = pathlib.Path(folder)
    path = folder / "recording.json"
    file = read_json(path, "flash-recording/", WRITER)
    try:
        own = _own_camera(folder, file.get("camera"))
        tracks = {name: _core.load_trajectory(str(folder / track)) for name, track in (file.get("trajectories") or {}).items()}
        seen = _keyframes(folder, file, own) + _markers(folder, file.get("markers") or {})
        grasps = [(grasp["gripper"], *_span(grasp)) for grasp in file.get("grasps") or []]
        name = str(file.get("name") or folder.name)
    except (KeyError, TypeError, AttributeError) as error:
        raise refusal(path, f"found no {error}, expected the fields of a recording") from None
    if not seen:
        raise refusal(path, f"found no keyframes, expected those that {WRITER} writes")
    seen.sort(key=lambda one: one[0])
    cameras = ([own] if own else []) + [_camera_of(pathlib.Path(camera)) for camera in camera_folders]
    times, clouds, forces = zip(*seen)
    return Recording(name, np.array(times, float), [_thinned(cloud) for cloud in clouds], [len(cloud) for cloud in clouds],
                     list(forces), tracks, grasps, cameras)


def _own_camera(folder, camera):
    if not camera:
        return None
    return Camera.of("camera", folder / camera["intrinsics"], matrix_of(camera["T_base_camera"]), camera.get("depth_scale", 1e-3))


def _camera_of(folder):
    pose = folder / "extrinsics.json"
    pose = pose if pose.is_file() else folder / "extrinsics.tum"
    return Camera.of(folder.name, folder / "camera_info.yaml", matrix_of(_core.load_camera_pose(str(pose))[0]))


def _keyframes(folder, file, camera):
    seen = []
    for k, keyframe in enumerate(file.get("keyframes") or []):
        cloud = np.empty((0, 3))
        if "depth" in keyframe:
            if not camera:
                raise refusal(folder / "recording.json", f"keyframes[{k}].depth: found no camera, expected the one that took it")
            mask = folder / keyframe["mask"] if "mask" in keyframe else None
            cloud = points_of(folder / keyframe["depth"], camera, mask)
        elif "cloud" in keyframe:
            cloud = _core.load_cloud(str(folder / keyframe["cloud"]))
        seen.append((float(keyframe["t"]), cloud, keyframe.get("force")))
    return seen


def _markers(folder, markers):
    if "tracks" not in markers:
        return []
    rows = read_table(folder / markers["tracks"], ("t", "x", "y", "z"))
    table = np.array([[row[name] for name in ("t", "x", "y", "z")] for row in rows]).reshape(-1, 4)
    starts = np.flatnonzero(np.diff(table[:, 0], prepend=-np.inf) > SAME_TIME)
    return [(float(part[0, 0]), part[:, 1:], None) for part in np.split(table, starts[1:]) if len(part)]


def _span(grasp):
    return tuple(otherwise if grasp.get(name) is None else float(grasp[name])
                 for name, otherwise in (("from", -np.inf), ("to", np.inf)))


def _thinned(cloud):
    return np.asarray(cloud, np.float32)[::max(1, -(-len(cloud) // MOST_POINTS))]


def show(server, recording):
    """Puts a recording on the page; what is to be called again and again."""
    box = page.box_about([*recording.clouds, *(track[:, 1:4] for track in recording.tracks.values())])
    page.furnish(server, box, around=[camera.pose[:3, 3] for camera in recording.cameras])
    timeline = page.Timeline(server, recording.times, first=len(recording.times) - 1)
    words = server.gui.add_markdown("")
    points = Points(server, "/seen", 0.002 * box.size)
    grippers = {}
    for name, track in recording.tracks.items():
        way = track[:, 1:4]
        if len(way) > 1:
            server.scene.add_line_segments(f"/way/{name}", np.stack([way[:-1], way[1:]], axis=1).astype(np.float32), (120, 120, 120),
                                           thickness=2.0, thickness_units="screen")
        frame = server.scene.add_frame(f"/gripper/{name}", axes_length=0.1 * box.size, axes_radius=0.004 * box.size)
        server.scene.add_label(f"/gripper/{name}/name", name)
        grippers[name] = (frame, Arrow(server, f"/force/{name}", box.size))
    for camera in recording.cameras:
        frustum = server.scene.add_camera_frustum(f"/camera/{camera.name}", camera.fov, camera.width / camera.height,
                                                  scale=0.15 * box.size, thickness=0.006 * box.size, color=(60, 60, 60))
        put(frustum, camera.pose)
        server.scene.add_label(f"/camera/{camera.name}/name", camera.name)
    strongest = max((np.linalg.norm(force) for force in recording.forces if force is not None), default=0.0)
    shown = None

    def tick():
        nonlocal shown
        frame = timeline.frame()
        if frame == shown:
            return
        time, force = recording.times[frame], recording.forces[frame]
        points.show(recording.clouds[frame])
        for name, (handle, arrow) in grippers.items():
            pose = pose_at(recording.tracks[name], time)
            put(handle, pose)
            if force is not None and recording.grasps and name == recording.grasps[-1][0]:
                arrow.show(pose[:3, 3], 0.3 * box.size / max(strongest, 1e-12) * np.array(force))
        words.content = frame_words(recording, frame)
        shown = frame
    return tick


def frame_words(recording, frame):
    """Markdown of what a keyframe has."""
    time, force = recording.times[frame], recording.forces[frame]
    lines = [f"**{recording.name}**, {len(recording.times)} keyframes", f"**Seen:** {recording.counts[frame]:,} points"]
    for name, track in recording.tracks.items():
        place = ", ".join(f"{1e3 * value:.1f}" for value in pose_at(track, time)[:3, 3])
        lines.append(f"**{name}:** at {place} mm, {'closed' if recording.held_by(name, time) else 'open'}")
    if force is not None:
        lines.append(f"**Force:** {', '.join(f'{value:.3f}' for value in force)} N")
    return "\n\n".join(lines)
