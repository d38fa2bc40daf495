#!/usr/bin/env python3
"""Whether `segment` and `import` take recordings of rendered cells whose inputs belong together, and refuse those in which one input
is wrong. The table goes into docs/validation/cells.md."""
import argparse
import collections
import concurrent.futures
import dataclasses
import json
import math
import pathlib
import random
import shutil
import subprocess
import sys

import numpy

import depth_png
import runs as kept
import synthetic
import tables

OPENGL = numpy.diag([1.0, -1.0, -1.0, 1.0])


@dataclasses.dataclass
class Cell:
    """What a user hands to the programs."""
    side: float
    camera: numpy.ndarray  # T_base_camera
    path: numpy.ndarray  # t, x, y, z of the tool [s, m]
    frames: list  # depth images
    names: list  # of the images
    times: str = "rate:10"
    table: float = 0.0
    heading: float | None = None  # [deg]
    stated: float = 1.0  # size over the true one
    height: float = 1.0  # of the sheet over its width, which is `side`
    swapped: bool = False  # width and height, as stated
    segment: tuple = ()
    imported: tuple = ()


def pose(rotation, translation):
    T = numpy.eye(4)
    T[:3, :3], T[:3, 3] = rotation, translation
    return T


def about_z(angle):
    c, s = math.cos(angle), math.sin(angle)
    return numpy.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])


def rotation_of(x, y, z, w):
    return numpy.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def quaternion_of(R):
    w, v = numpy.linalg.eigh(numpy.array([
        [R[0, 0] - R[1, 1] - R[2, 2], R[1, 0] + R[0, 1], R[2, 0] + R[0, 2], R[2, 1] - R[1, 2]],
        [R[1, 0] + R[0, 1], R[1, 1] - R[0, 0] - R[2, 2], R[2, 1] + R[1, 2], R[0, 2] - R[2, 0]],
        [R[2, 0] + R[0, 2], R[2, 1] + R[1, 2], R[2, 2] - R[0, 0] - R[1, 1], R[1, 0] - R[0, 1]],
        [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], R[0, 0] + R[1, 1] + R[2, 2]]]) / 3)
    return v[:, w.argmax()]


def rendered(runs, seed, high=False, oblong=False):
    """A lift by a corner, as a camera at its side or above it sees it, of a towel of 0.2 to 1.2 m; `high`: off the table; `oblong`: one
    side is 0.5 to 0.7 of the other."""
    draw = random.Random(seed)
    side = round(0.2 * 6 ** draw.random(), 2)
    ratio = random.Random(f"{seed} oblong").uniform(0.5, 0.7)
    height = (ratio if seed % 2 else 1 / ratio) if oblong else 1.0
    asset = synthetic.write_asset(runs.out, young=100.0)
    around, above = draw.uniform(-0.8, 0.8) - math.pi / 2, draw.uniform(0.9, 2.0)
    longer = side * max(1.0, height)
    camera = (longer * (0.5 + 2.2 * math.cos(around)), longer * (0.5 + 2.2 * math.sin(around)), 0.1 + longer * above)
    fov = draw.uniform(50, 75)
    name = f"cell_{seed}" + ("_high" if high else "") + ("_oblong" if oblong else "")
    folder = runs.synth(name, asset, "--mesh", f"sheet:{side}x{round(side * height, 4)}:{side / 12:.4f}", "--rate", "10", "--raw", "--resolution", "160x120",
                        "--fov", f"{fov:.1f}", f"--camera={camera[0]:.4f},{camera[1]:.4f},{camera[2]:.4f}", "--seed", str(seed),
                        *((f"--displacement={-0.25 * side:.4f},0,{1.5 * side:.4f}",) if high else ()),
                        *synthetic.settings({"bending": 5e-5 * 20 ** draw.random(), "friction": draw.uniform(0.2, 0.5)}))
    view = folder / "camera1"
    transform = json.loads((view / "extrinsics.json").read_text())["transform"]
    images = sorted((view / "depth").glob("*.png"))
    heading = math.degrees(math.atan2(-height, -1))  # of the corner 1,1, which the robot's kind holds
    return Cell(side, pose(rotation_of(*transform["rotation_xyzw"]), transform["translation"]), numpy.loadtxt(folder / "gripper.tum")[:, :4],
                [depth_png.read(image) for image in images], [image.name for image in images], heading=heading, height=height), view / "camera_info.yaml"


def rays(lens, shape):
    """Of the pixels, z = 1."""
    text = lens.read_text()
    k = [float(x) for x in text.split("camera_matrix")[1].split("[")[1].split("]")[0].split(",")]
    v, u = numpy.mgrid[:shape[0], :shape[1]]
    return numpy.stack([(u - k[2]) / k[0], (v - k[5]) / k[4], numpy.ones(shape)], -1)


def nearer(frame, depth):
    """The frame with a thing in it, of depth in metres, infinite where it is not; it hides what is behind."""
    counts = numpy.where(frame == 0, numpy.inf, frame / 1000.0)
    both = numpy.minimum(counts, depth)
    return numpy.where(numpy.isfinite(both) & (both < 60), numpy.rint(1000 * both), 0).astype(numpy.uint16)


def with_wall(cell, lens, draw):
    """A wall behind the cloth, a shelf's width before it."""
    directions = rays(lens, cell.frames[0].shape) @ cell.camera[:3, :3].T
    origin = cell.camera[:3, 3]
    middle = cell.path[:, 1:].mean(0)
    away = middle - origin
    away[2] = 0
    normal = away / numpy.linalg.norm(away)
    point = middle + normal * (cell.side * 1.1 + draw.uniform(0.05, 0.3))
    with numpy.errstate(divide="ignore", invalid="ignore"):
        t = ((point - origin) @ normal) / (directions @ normal)
    hit = origin + t[..., None] * directions
    depth = numpy.where((t > 0) & (hit[..., 2] > cell.table + 0.02) & (hit[..., 2] < cell.table + 3), t, numpy.inf)
    cell.frames = [nearer(frame, depth) for frame in cell.frames]


def with_arm(cell, lens, draw):
    """A vertical link of 3 to 5 cm above the gripper."""
    directions = rays(lens, cell.frames[0].shape) @ cell.camera[:3, :3].T
    origin, radius = cell.camera[:3, 3], draw.uniform(0.03, 0.05)
    frames = []
    for frame, row in zip(cell.frames, numpy.linspace(0, len(cell.path) - 1, len(cell.frames)).astype(int)):
        tool = cell.path[row, 1:]
        o = (origin - tool)[:2]
        a = (directions[..., :2] ** 2).sum(-1)
        b = (directions[..., :2] * o).sum(-1)
        with numpy.errstate(divide="ignore", invalid="ignore"):
            t = (-b - numpy.sqrt(b * b - a * (o @ o - radius ** 2))) / a
        height = origin[2] + t * directions[..., 2] - tool[2]
        frames.append(nearer(frame, numpy.where((t > 0) & (height > 0.1) & (height < 1), t, numpy.inf)))
    cell.frames = frames


def moved(cell, R, shift):
    T = pose(R, shift)
    cell.camera = T @ cell.camera
    cell.path = numpy.column_stack([cell.path[:, 0], cell.path[:, 1:] @ R.T + shift])
    cell.table += shift[2]
    cell.heading += math.degrees(math.atan2(R[1, 0], R[0, 0]))


def kept_frames(cell, draw, folder, declared):
    drop = set(draw.sample(range(2, len(cell.frames) - 2), 5))
    left = [i for i in range(len(cell.frames)) if i not in drop]
    cell.frames, cell.names = [cell.frames[i] for i in left], [cell.names[i] for i in left]
    if declared:
        cell.times = str(folder / "times.csv")
        (folder / "times.csv").write_text("t\n" + "".join(f"{i / 10:.3f}\n" for i in left))


def late_frames(cell):
    """Those of the first half are lost, and the others numbered anew."""
    lost = len(cell.frames) // 2
    cell.frames, cell.names = cell.frames[lost:], cell.names[:-lost]


def anywhere(draw):
    return about_z(draw.uniform(-math.pi, math.pi)), numpy.array([draw.uniform(-2, 2), draw.uniform(-2, 2), draw.uniform(-0.8, 1.2)])


def registered(cell, draw):
    """The camera is where a calibration of a few centimetres has it."""
    angle, way = draw.uniform(-0.03, 0.03), numpy.array([draw.uniform(-0.03, 0.03) for _ in range(3)])
    middle = cell.path[:, 1:].mean(0)
    cell.camera = pose(about_z(angle), middle - about_z(angle) @ middle + way) @ cell.camera
    cell.imported = ("--offset-bound", "0.06")


# What is done to a cell, in which the arguments are the cell, its lens, a source of chance and a folder.
HIGH = ("lifted off the table", "twice the cloth, off the table", "half the cloth, off the table")
RIGHT = {
    "as it is": lambda cell, lens, draw, folder: None,
    "lifted off the table": lambda cell, lens, draw, folder: None,
    "another base frame": lambda cell, lens, draw, folder: moved(cell, *anywhere(draw)),
    "a wall in view": lambda cell, lens, draw, folder: with_wall(cell, lens, draw),
    "an arm in view": lambda cell, lens, draw, folder: with_arm(cell, lens, draw),
    "gaps that are declared": lambda cell, lens, draw, folder: kept_frames(cell, draw, folder, True),
    "registered to 3 cm": lambda cell, lens, draw, folder: registered(cell, draw),
    "an oblong sheet": lambda cell, lens, draw, folder: None,
    "an oblong sheet, 5 deg off": lambda cell, lens, draw, folder: turned_heading(cell, draw.choice((-5, 5))),
    "an oblong sheet, 12 % off": lambda cell, lens, draw, folder: stated_size(cell, draw.choice((0.88, 1.12))),
    "wall, arm and another base": lambda cell, lens, draw, folder: (with_wall(cell, lens, draw), with_arm(cell, lens, draw),
                                                                    moved(cell, *anywhere(draw))),
}


def set_camera(cell, T):
    cell.camera = T


def millimetres(cell):
    cell.camera = cell.camera.copy()
    cell.camera[:3, 3] *= 1000


def world_gripper(cell, draw):
    """The poses of the tool are in a frame on the floor, before the robot's pedestal."""
    R, shift = about_z(draw.uniform(-1, 1)), numpy.array([draw.uniform(0.3, 1), draw.uniform(-0.6, 0.6), draw.uniform(0.3, 0.9)])
    cell.path = numpy.column_stack([cell.path[:, 0], cell.path[:, 1:] @ R.T + shift])


def flange(cell, draw):
    cell.path = cell.path + numpy.array([0, 0, 0, draw.uniform(0.1, 0.16)])


def turned_heading(cell, angle):
    cell.heading += angle


def stated_size(cell, factor):
    cell.stated = factor


def swapped_sides(cell):
    cell.swapped = True


def other_table(cell, draw):
    cell.imported = (f"--table-z={cell.table + draw.choice((-1, 1)) * draw.uniform(0.08, 0.15):.4f}",)


def other_times(cell):
    cell.imported = ("--times", "rate:15")


WRONG = {
    "axes of OpenGL": lambda cell, lens, draw, folder: set_camera(cell, cell.camera @ OPENGL),
    "the base in the camera": lambda cell, lens, draw, folder: set_camera(cell, numpy.linalg.inv(cell.camera)),
    "the camera in millimetres": lambda cell, lens, draw, folder: millimetres(cell),
    "a gripper in another frame": lambda cell, lens, draw, folder: world_gripper(cell, draw),
    "the flange for the tool": lambda cell, lens, draw, folder: flange(cell, draw),
    "lost frames and a rate": lambda cell, lens, draw, folder: kept_frames(cell, draw, folder, False),
    "half of the frames lost, numbered anew": lambda cell, lens, draw, folder: late_frames(cell),
    "half a turn of the heading": lambda cell, lens, draw, folder: turned_heading(cell, 180),
    "twice the cloth, off the table": lambda cell, lens, draw, folder: stated_size(cell, 2.0),
    "half the cloth, off the table": lambda cell, lens, draw, folder: stated_size(cell, 0.5),
    "an oblong sheet, sides swapped": lambda cell, lens, draw, folder: swapped_sides(cell),
    "another table": lambda cell, lens, draw, folder: other_table(cell, draw),
    "other times": lambda cell, lens, draw, folder: other_times(cell),
}


def written(cell, lens, folder):
    view = folder / "camera"
    (view / "depth").mkdir(parents=True)
    for name, frame in zip(cell.names, cell.frames):
        depth_png.write(view / "depth" / name, frame)
    shutil.copy(lens, view / "camera_info.yaml")
    (view / "extrinsics.json").write_text(json.dumps({"schema": "flash-extrinsics/2", "transform": {
        "parent": "base", "child": "camera", "translation": cell.camera[:3, 3].tolist(),
        "rotation_xyzw": quaternion_of(cell.camera[:3, :3]).tolist()}}))
    numpy.savetxt(folder / "tool.tum", numpy.column_stack([cell.path, numpy.zeros((len(cell.path), 3)), numpy.ones(len(cell.path))]), "%.9g")
    return view


def said_of(sysid, cell, lens, folder):
    """The error of the first program that refuses, or nothing."""
    view = written(cell, lens, folder)
    size = [cell.side * cell.stated, cell.side * cell.stated * cell.height][::-1 if cell.swapped else 1]
    for verb in (["segment", view, "--trajectory", folder / "tool.tum", "--times", cell.times, *cell.segment, "-o", folder / "segmented"],
                 ["import", folder / "segmented" / "frames", "--mesh", f"sheet:{size[0]:.4f}x{size[1]:.4f}:{min(size) / 12:.4f}", "--grasp", "corner:1,1",
                  "--tool-at", "patch", f"--heading={cell.heading:.3f}", *cell.imported, "-o", folder / "lift"]):
        done = subprocess.run([sysid, *map(str, verb), "--quiet"], capture_output=True, text=True)
        if done.returncode == 2:
            return done.stderr.strip().splitlines()[-1]
        if done.returncode != 0:
            sys.exit(f"cells: {' '.join(map(str, verb))}\n{done.stderr}")
    return ""


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sysid", required=True, help="the program flash-sysid")
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--documents", type=pathlib.Path, help="the folder of cells.md, whose table is renewed")
    parser.add_argument("--seed", type=int, default=62001, help="of the first cell; the others follow")
    parser.add_argument("--cells", type=int, default=13, help="rendered; each is used once for every way to be right or wrong")
    parser.add_argument("--keep", action="store_true", help="keep the folders")
    options = parser.parse_args()
    runs = kept.Runs(options.sysid, options.out)
    jobs = [(seed, right, name) for seed in range(options.seed, options.seed + options.cells)
            for right, ways in ((True, RIGHT), (False, WRONG)) for name in ways]

    def done(job):
        seed, right, name = job
        cell, lens = rendered(runs, seed, name in HIGH, "oblong" in name)
        draw = random.Random(f"{seed} {name}")
        folder = options.out / f"{seed}_{'right' if right else 'wrong'}_{name.replace(' ', '_')}"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        (RIGHT if right else WRONG)[name](cell, lens, draw, folder)
        said = said_of(options.sysid, cell, lens, folder)
        if not options.keep:
            shutil.rmtree(folder)
        return job, said

    for seed in range(options.seed, options.seed + options.cells):
        for high, oblong in ((False, False), (True, False), (False, True)):
            rendered(runs, seed, high, oblong)
    counts = collections.defaultdict(lambda: [0, 0, ""])
    failed = 0
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        for (seed, right, name), said in pool.map(done, jobs):
            count = counts[right, name]
            count[0] += 1
            count[1] += (said == "") == right
            count[2] = count[2] or said
            if (said == "") != right:
                failed += 1
                print(f"{seed} {'right' if right else 'wrong'}, {name}: {said or 'taken'}", flush=True)
    rows = [["right" if right else "wrong", name, f"{good} of {all_}"] for (right, name), (all_, good, _) in counts.items()]
    for right in (True, False):
        print("right" if right else "wrong", sum(c[0] for (r, _), c in counts.items() if r == right), "as expected",
              sum(c[1] for (r, _), c in counts.items() if r == right))
    if options.documents:
        tables.replace_tables(options.documents, {"cells": tables.table(["inputs", "what", "taken, or refused where wrong"], rows)})
    else:
        for row in rows:
            print(" | ".join(row))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
