"""Lifts out of recordings: depth, times and gripper as `flash-sysid segment` reads them."""
import json
import subprocess

import bag_fixtures as fixtures
import numpy as np
import pytest
from bag_fixtures import CONTAINERS, SECOND, START, Cell, pose, rotation
from conftest import ROOT
from test_bag import contents, program

from flash_sim.bag.__main__ import main

pytest.importorskip("rosbags", reason="rosbags is not installed, which reads bags")
pytest.importorskip("PIL", reason="Pillow is not installed, which reads compressed pictures")

DEPTH, INFO = "/camera/depth/image_raw", "/camera/depth/camera_info"
MS = 1_000_000


def run(name, *words):
    done = subprocess.run([program(name), *map(str, words)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def lift(tmp_path_factory):
    """What `synth --raw` writes, with the times of a unix clock; the folder and the recording of it."""
    from PIL import Image
    folder = tmp_path_factory.mktemp("lift") / "recording"
    run("flash-sysid", "synth", "--asset", ROOT / "examples/assets/towel.json", "--mesh", "sheet:0.2x0.2:0.05", "--raw",
        "--resolution", "160x120", "--duration", "1", "--quiet", "-o", folder)
    view = folder / "camera1"
    extrinsics = json.loads((view / "extrinsics.json").read_text())["transform"]
    place, (x, y, z, w) = extrinsics["translation"], extrinsics["rotation_xyzw"]
    T_base_camera = pose(place, rotation([x, y, z], 2 * np.arctan2(np.linalg.norm([x, y, z]), w)))
    lens = fixtures.lens(160, 120)
    lens.fx = lens.fy = 80 / np.tan(np.radians(30))
    lens.cx, lens.cy = 79.5, 59.5
    cell = Cell()
    rows = np.loadtxt(folder / "gripper.tum")
    for t, *values in rows:
        x, y, z, w = values[3:]
        turn = rotation([x, y, z], 2 * np.arctan2(np.linalg.norm([x, y, z]), w)) if np.linalg.norm([x, y, z]) > 0 else np.eye(3)
        cell.tf(START + round(t * 1000) * MS, ("base", "tcp", pose(values[:3], turn)))
    cell.tf(START, ("base", "camera_optical", T_base_camera), static=True)
    for k, path in enumerate(sorted((view / "depth").iterdir())):
        cell.image(DEPTH, START + 100 * k * MS, np.asarray(Image.open(path)).astype(np.uint16), "16UC1", pad=6)
        cell.info(INFO, START + 100 * k * MS, lens)
    times = [START / 1e9 + 0.1 * k for k in range(k + 1)]
    (folder / "times.csv").write_text("t\n" + "".join(f"{time:.9f}\n" for time in times))
    lines = [" ".join(map(repr, [START / 1e9 + t, *values])) for t, *values in rows.tolist()]
    (folder / "gripper.tum").write_text("\n".join(lines) + "\n")
    return folder, cell


def segmented(folder, out):
    run("flash-sysid", "segment", folder / "camera1", "--trajectory", folder / "gripper.tum", "--times", folder / "times.csv",
        "-o", out)
    return contents(out / "frames")


def test_five_containers_give_one_folder_and_the_cloth_of_the_frames_themselves(tmp_path, lift):
    folder, cell = lift
    expected = segmented(folder, tmp_path / "plain")
    assert len(expected) == 11
    folders = []
    for container in CONTAINERS:
        (tmp_path / container).mkdir()
        out = tmp_path / container / "raw"
        assert main([str(cell.write(tmp_path / container, container)), "-o", str(out), "--for", "segment", "--quiet"]) == 0
        folders.append(contents(out))
        if container == CONTAINERS[0]:
            assert segmented(out, tmp_path / "cut") == expected
    assert all(other == folders[0] for other in folders)
    assert sorted(folders[0]) == [*(["camera1/camera_info.yaml"] + [f"camera1/depth/{k:06d}.png" for k in range(11)]
                                    + ["camera1/extrinsics.json"]), "gripper.tum", "times.csv"]


def test_depth_in_metres_is_the_same_cloth(tmp_path, lift):
    """Of 32FC1, which stays what it is; float32 moves a point of 1 m by 6e-8 m, and the bytes of the clouds with it."""
    folder, cell = lift
    other = Cell()
    for topic, kind, time, fields in cell.entries:
        if topic == DEPTH:
            rows = fields["data"].reshape(fields["height"], fields["step"])[:, :2 * fields["width"]]
            metres = np.ascontiguousarray(rows).view(np.uint16).astype(np.float32) / 1000
            fields = {**fields, "encoding": "32FC1", "step": 4 * fields["width"], "data": metres.reshape(-1).view(np.uint8)}
        other.entries.append((topic, kind, time, fields))
    out = tmp_path / "raw"
    assert main([str(other.write(tmp_path, "ros1")), "-o", str(out), "--for", "segment", "--quiet"]) == 0
    assert (out / "camera1/depth/000010.npy").exists()
    found, expected = segmented(out, tmp_path / "cut"), segmented(folder, tmp_path / "plain")
    counts = [[int(file.split(b"element vertex ")[1].split()[0]) for file in files.values()] for files in (found, expected)]
    assert np.abs(np.subtract(*counts)).max() <= 3 and max(counts[1]) > 300


def test_the_command_that_comes_next_is_one_that_works(tmp_path, lift, capsys, monkeypatch):
    _, cell = lift
    source = cell.write(tmp_path, "mcap")
    monkeypatch.chdir(tmp_path)
    assert main([str(source), "-o", "my lift", "--for", "segment"]) == 0
    command = capsys.readouterr().out.splitlines()[-1].removeprefix("next: ")
    command = command.replace("flash-sysid", str(program("flash-sysid")), 1)
    done = subprocess.run(command, shell=True, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "segmented/segment.svg").exists()


def test_a_part_of_a_lift_and_extrinsics_of_ones_own(tmp_path, lift):
    folder, cell = lift
    source = cell.write(tmp_path, "mcap")
    out = tmp_path / "out"
    assert main([str(source), "-o", str(out), "--for", "segment", "--from", "0.25", "--until", "0.7", "--quiet", "--extrinsics",
                 str(folder / "camera1/extrinsics.json")]) == 0
    times = (out / "times.csv").read_text().splitlines()[1:]
    assert times == [f"{START // SECOND}.{START % SECOND + 100 * k * MS:09d}" for k in range(3, 8)]
    assert (out / "camera1/extrinsics.json").read_bytes() == (folder / "camera1/extrinsics.json").read_bytes()


def cloud(points, step=20):
    """A PointCloud2 with y, z and x in another order, and bytes between."""
    data = np.zeros((len(points), step), np.uint8)
    for offset, values in ((0, points[:, 1]), (8, points[:, 2]), (12, points[:, 0])):
        data[:, offset:offset + 4] = values.astype("<f4")[:, None].view(np.uint8)
    fields = [{"name": name, "offset": offset, "datatype": 7, "count": 1} for name, offset in (("x", 12), ("y", 0), ("z", 8))]
    return {"height": 1, "width": len(points), "fields": fields, "point_step": step, "row_step": step * len(points),
            "data": data.ravel()}


def test_clouds(tmp_path, lift, capsys):
    """In the frame of the camera, with its place; what is not finite is left out."""
    _, cell = lift
    points = np.random.default_rng(3).normal(size=(50, 3)).astype(np.float32)
    points[7] = np.nan
    other = Cell()
    other.entries = [entry for entry in cell.entries if "tf" in entry[0]]
    for k in range(4):
        other.add("/camera/points", "sensor_msgs/msg/PointCloud2", START + 100 * k * MS, frame="camera_optical",
                  **cloud(points + k))
    out = tmp_path / "out"
    assert main([str(other.write(tmp_path, "db3")), "-o", str(out), "--for", "segment", "--quiet"]) == 0
    found = (out / "camera1/000002.ply").read_bytes()
    assert b"element vertex 49\n" in found
    read = np.frombuffer(found.split(b"end_header\n", 1)[1], "<f4").reshape(-1, 3)
    assert (read == np.delete(points + 2, 7, axis=0)).all()
    other.entries = [entry for entry in other.entries if entry[0] != "/tf_static"]
    (tmp_path / "b").mkdir()
    assert main([str(other.write(tmp_path / "b", "mcap")), "-o", str(tmp_path / "b/out"), "--for", "segment", "--quiet"]) == 2
    assert "--extrinsics" in capsys.readouterr().err and not (tmp_path / "b/out").exists()
