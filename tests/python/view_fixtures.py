"""Folders of runs and of recordings that are small and known."""
import json

import numpy as np

TIMES = (0.0, 0.5, 1.0)
SQUARE = np.array([[0.0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]])
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])
LIFTED = [SQUARE + [0, 0, 0.02 * t] for t in TIMES]  # a square that goes up
SEEN = [np.empty((0, 3)), *(np.random.default_rng(k).uniform(0, 0.1, (50, 3)) * [1, 1, 0] + [0, 0, 0.01 * k + 0.001] for k in (1, 2))]
SUMMARY = {"schema": "flash-sysid-summary/2", "axes": ["bending", "young", "friction"], "settings": {"thickness_m": "0.001"},
           "best": {"parameters": {"bending": 1.5e-4, "young": 1e5, "friction": 0.3}, "score": 6.4e-4},
           "parameters": {"bending": {"interval95": [1.4e-4, 1.6e-4], "identifiable": "yes"},
                          "young": {"interval95": [5e4, 1e6], "identifiable": "lower_bound"},
                          "friction": {"interval95": [0.2, 0.4], "identifiable": "no"}},
           "recordings": [{"name": "lift", "offset": [0.012, -0.008, 0.0]}], "warnings": ["young was not measured"], "exit_code": 0}
RESULTS = ("id,bending,young,friction,score_m,status\n0,1e-4,1e5,0.3,0.002,ok\n1,1.5e-4,1e5,0.3,0.0007,ok\n"
           "2,9e-4,1e5,0.3,inf,diverged\n")


def ply(points, triangles=()):
    """Text of a PLY file."""
    head = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\nproperty double x\nproperty double y\nproperty double z\n"
    faces = f"element face {len(triangles)}\nproperty list uchar int vertex_indices\n" if len(triangles) else ""
    lines = [" ".join(repr(float(value)) for value in row) for row in points] + [f"3 {a} {b} {c}" for a, b, c in triangles]
    return head + faces + "end_header\n" + "".join(line + "\n" for line in lines)


def write_replay(folder, meshes=LIFTED):
    """What flash-sysid replay leaves of three keyframes."""
    folder.mkdir(parents=True)
    rows = ["t,score_m,points"]
    for k, (time, mesh, cloud) in enumerate(zip(TIMES, meshes, SEEN)):
        (folder / f"{k:03d}_mesh.ply").write_text(ply(mesh, TRIANGLES))
        (folder / f"{k:03d}_cloud.ply").write_text(ply(cloud))
        rows.append(f"{time},{0.001 * k},{len(cloud)}")
    (folder / "overlay.csv").write_text("\n".join(rows) + "\n")
    return folder


def write_run(folder, **changes):
    """What a search leaves, as far as the viewer reads it."""
    write_replay(folder / "best" / "lift")
    (folder / "summary.json").write_text(json.dumps(SUMMARY | changes))
    (folder / "results.csv").write_text(RESULTS)
    return folder


def write_recording(folder, **changes):
    """Three clouds, and a gripper that goes up by 0.1 m while it turns by 90 degrees about z."""
    (folder / "frames").mkdir(parents=True)
    for k, cloud in enumerate(SEEN):
        (folder / "frames" / f"{k}.ply").write_text(ply(cloud))
    (folder / "gripper.tum").write_text("0 0.1 0.1 0 0 0 0 1\n1 0.1 0.1 0.1 0 0 0.70710678118654757 0.70710678118654757\n")
    file = {"schema": "flash-recording/1", "name": "lift", "trajectories": {"gripper": "gripper.tum"},
            "grasps": [{"gripper": "gripper", "from": 0.4, "to": None}],
            "keyframes": [{"t": time, "cloud": f"frames/{k}.ply", "force": [0, 0, -0.1 * k]} for k, time in enumerate(TIMES)]}
    (folder / "recording.json").write_text(json.dumps(file | changes))
    return folder


def write_camera(folder):
    """A camera 0.5 m above the origin that looks down, x of its pictures along x."""
    folder.mkdir(parents=True)
    (folder / "camera_info.yaml").write_text(
        "image_width: 80\nimage_height: 60\ncamera_name: top\ndistortion_model: plumb_bob\n"
        "camera_matrix: {rows: 3, cols: 3, data: [70, 0, 39.5, 0, 70, 29.5, 0, 0, 1]}\n"
        "distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n")
    transform = {"parent": "base", "child": "camera", "translation": [0, 0, 0.5], "rotation_xyzw": [1, 0, 0, 0]}
    (folder / "extrinsics.json").write_text(json.dumps({"schema": "flash-extrinsics/2", "transform": transform}))
    return folder
