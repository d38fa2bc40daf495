#!/usr/bin/env python3
"""From a scan to a drape: `flash-sim mesh` makes a mesh and its flat rest shape of a cloud, which `flash-sim run` takes;
depth frames are fused; what is no scan is refused in one line and leaves nothing."""
import argparse
import json
import math
import pathlib
import random
import shutil
import struct
import sys
import tempfile

import program
from malformed_inputs import png

REFUSED, UNUSABLE = 2, 3
CUBE = [(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2),
        (1, 3, 7), (1, 7, 5)]


def ply(points, binary):
    kind = "binary_little_endian" if binary else "ascii"
    head = f"ply\nformat {kind} 1.0\nelement vertex {len(points)}\n" + "".join(f"property float {axis}\n" for axis in "xyz")
    body = b"".join(struct.pack("<3f", *p) for p in points) if binary else "".join(
        f"{p[0]:.6g} {p[1]:.6g} {p[2]:.6g}\n" for p in points).encode()
    return (head + "end_header\n").encode() + body


def obj(points, triangles):
    return "".join(f"v {x} {y} {z}\n" for x, y, z in points) + "".join(
        f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in triangles)


def rolled(width, height, radius, count, noise, seed):
    """A sheet on a cylinder about the y axis, 0.1 above z = 0 at its lowest."""
    draw = random.Random(seed)
    low = radius * math.cos(width / 2 / radius)
    for _ in range(count):
        angle, r = draw.uniform(-width / 2, width / 2) / radius, radius + draw.gauss(0, noise)
        yield r * math.sin(angle), draw.uniform(0, height), r * math.cos(angle) - low + 0.1


def check_drape(sim, folder):
    """The scanned sheet falls on a table and comes to lie there, as wide as it is when flat."""
    (folder / "scan.ply").write_bytes(ply(list(rolled(0.24, 0.16, 0.15, 12000, 0.001, 1)), True))
    done = program.call(sim, "mesh", "scan.ply", "--edge", "0.02", "-o", "cloth.obj", "--flat", "flat.obj", "--json",
                        cwd=folder)
    yield done.returncode == 0 and done.stderr == "", f"mesh: exit code {done.returncode}: {done.stderr}"
    made = json.loads(done.stdout)
    # Each border is uncertain by 2.5 s / sqrt(n) of the n = 2 pi s^2 * 12000 / (0.24 * 0.16) points at a place.
    s = 0.75 * 0.02
    tolerance = 5 * s / math.sqrt(2 * math.pi * s * s * 12000 / (0.24 * 0.16))
    for field, size in (("width_m", 0.24), ("height_m", 0.16)):
        yield abs(made["flat"][field] - size) < tolerance, f"flat: {field} {made['flat'][field]}, expected {size}"
    yield 0.5 * 0.02 < made["edge_min_m"] and made["edge_max_m"] < 1.6 * 0.02, f"edges: {made}"
    (folder / "asset.json").write_text(json.dumps(program.ASSET | {"mesh": "flat.obj"}))
    (folder / "scene.json").write_text(json.dumps(
        {"schema": "flash-scene/1", "timestep": 0.01, "steps": 100, "gravity": [0, 0, -9.81],
         "obstacles": {"table": {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1], "friction": 0.3}},
         "objects": {"cloth": {"asset": "asset.json", "start": {"mesh": "cloth.obj"}}}, "keyframes": [0, 1]}))
    done = program.call(sim, "run", "scene.json", "-o", "out", "--quiet", cwd=folder)
    yield done.returncode == 0, f"run: exit code {done.returncode}: {done.stderr}"
    points = last_points(folder / "out/frames/000100.ply")
    yield len(points) == made["vertices"], f"run: {len(points)} vertices, expected {made['vertices']}"
    lowest, highest = min(p[2] for p in points), max(p[2] for p in points)
    yield -1e-4 < lowest and highest < 0.1, f"run: the cloth is between {lowest} and {highest}, expected on the table"
    again = program.call(sim, "mesh", "scan.ply", "--edge", "0.02", "-o", "again.obj", cwd=folder)
    yield again.returncode == 0, f"mesh again: {again.stderr}"
    yield (folder / "again.obj").read_bytes() == (folder / "cloth.obj").read_bytes(), "mesh: differs from itself"


def last_points(path):
    data = path.read_bytes()
    head, _, body = data.partition(b"end_header\n")
    count = int(head.split(b"element vertex ")[1].split()[0])
    size = 8 if b"property double x" in head else 4
    return [struct.unpack_from("<3d" if size == 8 else "<3f", body, 3 * size * i) for i in range(count)]


def check_depth(sim, folder):
    """A level sheet 0.2 x 0.15 m seen by a camera that moves: two frames, each of half of it."""
    focal, width, height, away = 400, 320, 240, 0.8
    (folder / "depth").mkdir()
    (folder / "camera.yaml").write_text(
        f"image_width: {width}\nimage_height: {height}\ncamera_name: c\ndistortion_model: plumb_bob\n"
        f"camera_matrix: {{rows: 3, cols: 3, data: [{focal}, 0, 159.5, 0, {focal}, 119.5, 0, 0, 1]}}\n"
        "distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n")
    poses = []
    for k, shift in enumerate((-0.3, 0.3)):  # T_world_camera: looks down, turned about x
        rows = []
        for v in range(height):
            row = b""
            for u in range(width):
                x, y = shift + (u - 159.5) / focal * away, -(v - 119.5) / focal * away
                row += (int(away * 1000) if abs(x) < 0.1 and abs(y) < 0.075 else 0).to_bytes(2, "big")
            rows.append(row)
        (folder / f"depth/{k}.png").write_bytes(png(width, height, 16, rows))
        poses.append(f"{k} {shift} 0 {away} 1 0 0 0")
    (folder / "poses.tum").write_text("\n".join(poses) + "\n")
    words = ["mesh", "depth", "--intrinsics", "camera.yaml", "--poses", "poses.tum", "-o", "sheet.ply", "--flat",
             "sheet_flat.ply", "--json"]
    done = program.call(sim, *words, cwd=folder)
    yield done.returncode == 0, f"depth: exit code {done.returncode}: {done.stderr}"
    flat = json.loads(done.stdout)["flat"]
    # Pixels are 2 mm apart: a border is half of that off, and each corner counts as the least rectangle's.
    yield abs(flat["width_m"] - 0.2) < 0.003 and abs(flat["height_m"] - 0.15) < 0.003, f"depth: {flat}"
    (folder / "one.tum").write_text(poses[0] + "\n")
    words[words.index("poses.tum")] = "one.tum"
    yield from refused(sim, folder, [*words, "--force"], "one.tum: found 1 poses, expected 2")


def check_cap(sim, folder):
    """A quarter of a sphere does not develop: exit code 3, and the strain is told."""
    draw, points = random.Random(2), []
    while len(points) < 12000:
        p = [draw.gauss(0, 1) for _ in range(3)]
        r = math.sqrt(sum(x * x for x in p))
        if p[2] / r > math.cos(1):
            points.append([0.1 * x / r for x in p])
    (folder / "cap.ply").write_bytes(ply(points, True))
    done = program.call(sim, "mesh", "cap.ply", "-o", "cap.obj", "--flat", "cap_flat.obj", "--json", cwd=folder)
    yield done.returncode == UNUSABLE, f"cap: exit code {done.returncode}: {done.stderr}"
    yield "warning: the surface does not develop" in done.stderr, f"cap: {done.stderr}"
    # K r^2 / (16 sqrt 2) with K r^2 = 1, to the fifth or so that the plate's theory leaves out at such an angle.
    strain = json.loads(done.stdout)["flat"]["strain_rms"]
    yield 0.75 < strain * 16 * math.sqrt(2) < 1.25, f"cap: strained by {strain} rms"


def check_spike(sim, folder):
    """A narrow hill has no room in the plane: its triangles turn over, and the flat shape is refused."""
    side, cells = 0.2, 40
    points = [(side * (k % (cells + 1)) / cells, side * (k // (cells + 1)) / cells) for k in range((cells + 1) ** 2)]
    hill = [(x, y, 0.5 * math.exp(-((x - 0.1) ** 2 + (y - 0.1) ** 2) / 4e-4)) for x, y in points]
    first = [k for k in range(len(points) - cells - 1) if k % (cells + 1) < cells]
    (folder / "spike.obj").write_text(obj(hill, [t for k in first for t in ((k, k + 1, k + cells + 2),
                                                                            (k, k + cells + 2, k + cells + 1))]))
    words = ["mesh", "spike.obj", "-o", "out.obj", "--flat", "flat.obj"]
    yield from refused(sim, folder, words, "spike.obj", "triangles turned over", "--despite-doubts")
    yield from refused(sim, folder, [*words, "--force"], "triangles turned over", "--despite-doubts")
    done = program.call(sim, *words, "--despite-doubts", "--json", cwd=folder)
    yield done.returncode == UNUSABLE and "turned over" in done.stderr, f"spike: {done.returncode}: {done.stderr}"
    yield json.loads(done.stdout)["flat"]["turned_over"] > 0, f"spike: {done.stdout}"


def check_tets(sim, folder):
    corners = [(100 * (i & 1), 100 * (i >> 1 & 1), 100 * (i >> 2)) for i in range(8)]
    (folder / "cube.obj").write_text(obj(corners, CUBE))
    words = ["mesh", "cube.obj", "--tets", "--scale", "0.001", "--edge", "0.03", "-o", "cube.vtk", "--json"]
    if shutil.which("tetgen"):
        done = program.call(sim, *words, cwd=folder)
        yield done.returncode == 0, f"tets: exit code {done.returncode}: {done.stderr}"
        yield abs(json.loads(done.stdout)["volume_m3"] - 0.001) < 1e-15, f"tets: {done.stdout}"
    yield from refused(sim, folder, [*words, "--force"], "tetgen", "not installed", env={"PATH": "/nowhere"})
    yield from refused(sim, folder, ["mesh", "cube.obj", "--tets", "-o", "cube.stl"], "cube.stl", ".vtk or .tet")


def check_welded(sim, folder):
    """Doubled vertices and surfaces that pass through themselves are named; --weld joins the former, and nothing else."""
    (folder / "two.tet").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nt 1 2 3 4\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 -1\nt 5 7 6 8\n")
    done = program.call(sim, "mesh", "two.tet", "--weld", "--scale", "0.1", "-o", "joined.vtk", "--json", cwd=folder)
    yield done.returncode == 0, f"weld: exit code {done.returncode}: {done.stderr}"
    said = json.loads(done.stdout)
    yield (said["vertices"], said["tetrahedra"], said["joined"]) == (5, 2, 3), f"weld: {done.stdout}"
    corners = [(100 * (i & 1), 100 * (i >> 1 & 1), 100 * (i >> 2)) for i in range(8)]
    (folder / "soup.obj").write_text(obj([corners[v] for t in CUBE for v in t], [(3 * t, 3 * t + 1, 3 * t + 2) for t in range(12)]))
    done = program.call(sim, "mesh", "soup.obj", "--weld", "-o", "welded.obj", "--json", cwd=folder)
    yield done.returncode == 0 and json.loads(done.stdout)["vertices"] == 8, f"weld: {done.stdout}{done.stderr}"
    yield from refused(sim, folder, ["mesh", "two.tet", "--weld", "-o", "two.obj"], "two.obj", ".vtk or .tet")
    yield from refused(sim, folder, ["mesh", "two.tet", "--weld", "--tets", "-o", "t.vtk"], "--weld")
    (folder / "pierced.obj").write_text(obj([(50, 40, 150), *corners[1:]], CUBE))
    yield from refused(sim, folder, ["mesh", "pierced.obj", "--tets", "-o", "p.vtk"], "pierced.obj: triangle", "passes through triangle")


def check_bad(sim, folder):
    sheet = [(0.005 * (k % 20), 0.005 * (k // 20), 0) for k in range(400)]
    triangles = [t for k in range(380) if k % 20 < 19 for t in ((k, k + 1, k + 21), (k, k + 21, k + 20))]
    for name, content in (("empty.ply", b""), ("one.ply", ply(sheet[:1], False)), ("garbage.stl", b"\0" * 50),
                          ("metres.ply", ply([(1000 * x, 1000 * y, z) for x, y, z in sheet], True)),
                          ("short.ply", ply(sheet, True)[:-6]), ("scan.xyz", b"0 0 0\n"),
                          ("line.ply", ply([(1e-4 * k, 0, 0) for k in range(3000)], False)),
                          ("far.ply", ply([*sheet, (1e30, 0, 0)], True))):
        (folder / name).write_bytes(content)
    (folder / "fin.obj").write_text(obj([*sheet, (0.05, 0.05, 0.1)], [*triangles, (190, 191, 400)]))
    (folder / "nan.obj").write_text(obj([(math.nan, 0, 0), *sheet[1:]], triangles))
    (folder / "large.obj").write_text(obj([(1000 * x, 1000 * y, z) for x, y, z in sheet], triangles))
    (folder / "none").mkdir()
    for name, *expected in (("empty.ply", "empty.ply", "not a PLY file"), ("one.ply", "found 1 points, expected 20"),
                            ("garbage.stl", "garbage.stl", "not an STL file"), ("metres.ply", "apart", "--scale 0.001"),
                            ("short.ply", "ends before"), ("scan.xyz", ".xyz", "expected .ply"),
                            ("fin.obj", "no part of one surface", "--points"), ("nan.obj", "not finite", "index 0"),
                            ("large.obj", "vertices of --edge", "--scale 0.001"), ("none", "none: found no .ply"),
                            ("far.ply", "far.ply", "spans"), ("nowhere.ply", "nowhere.ply")):
        yield from refused(sim, folder, ["mesh", name, "-o", "out.obj", "--flat", "flat.obj"], *expected)
    (folder / "sheet.ply").write_bytes(ply(sheet, False))
    for words, *expected in ((["sheet.ply", "-o", "out.stl"], "out.stl", "expected .ply, .obj or .vtk"),
                             (["sheet.ply", "-o", "a.obj", "--flat", "a.obj"], "a.obj", "named twice"),
                             (["sheet.ply", "-o", "a.obj", "--flat", "./a.obj"], "a.obj", "named twice"),
                             (["sheet.ply", "-o", "sheet.ply"], "sheet.ply", "is read by this run"),
                             (["sheet.ply", "-o", "sheet.ply", "--force"], "sheet.ply", "is read by this run"),
                             (["sheet.ply", "-o", "a.obj", "--flat", "sheet.ply", "--force"], "sheet.ply", "is read by this run"),
                             (["sheet.ply", "-o", "a.obj", "--scale", "1e300"], "sheet.ply", "--scale"),
                             (["fin.obj", "-o", "a.obj", "--scale", "1e300"], "fin.obj", "--scale"),
                             (["sheet.ply", "-o", "a.obj", "--edge", "0"], "--edge"),
                             (["sheet.ply", "-o", "a.obj", "--poses", "p.tum"], "--intrinsics")):
        yield from refused(sim, folder, ["mesh", *words], *expected)
    # A cloud may have pixels that saw nothing; they are counted.
    (folder / "pixels.ply").write_bytes(ply([*sheet, (math.nan, 0, 0)], True))
    done = program.call(sim, "mesh", "pixels.ply", "-o", "pixels.obj", cwd=folder)
    yield done.returncode == 0 and "1 points that are not finite were left out" in done.stderr, f"pixels: {done.stderr}"
    # A line of points has no surface of its own: whatever comes of it, it is no traceback.
    done = program.call(sim, "mesh", "line.ply", "-o", "line.obj", cwd=folder)
    yield done.returncode in (0, REFUSED) and done.stderr.count("\n") <= 2, f"line: {done.returncode}: {done.stderr}"


def refused(sim, folder, words, *expected, **more):
    """Statements: exit code 2, one line that has all of `expected`, nothing left."""
    before = sorted(folder.rglob("*"))
    done = program.call(sim, *words, cwd=folder, **more)
    text, where = done.stderr.rstrip("\n"), " ".join(words)
    yield done.returncode == REFUSED, f"{where}: exit code {done.returncode}: {text[:500]}"
    yield text and "\n" not in text, f"{where}: not one line: {text[:500]}"
    yield all(word in text for word in expected), f"{where}: does not say {expected}: {text[:500]}"
    yield sorted(folder.rglob("*")) == before, f"{where}: left something"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sim", required=True, type=pathlib.Path)
    sim = parser.parse_args().sim.resolve()
    failures = 0
    for check in (check_drape, check_depth, check_cap, check_spike, check_tets, check_welded, check_bad):
        with tempfile.TemporaryDirectory() as name:
            for held, statement in check(sim, pathlib.Path(name)):
                if not held:
                    print(f"{check.__name__}: {statement}")
                    failures += 1
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
