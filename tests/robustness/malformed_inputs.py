#!/usr/bin/env python3
"""Damages files that the programs made themselves, one thing at a time, and hands them back: each must be refused with
exit code 2 and one line that names the file and the field, and must leave nothing behind."""
import argparse
import copy
import json
import os
import pathlib
import shutil
import struct
import sys
import tempfile
import zlib

import program

NAN = float("nan")
ABSENT = object()


class Case:
    """damage(folder) changes the copy of the sound files; `verb` reads them; the message has all of `words`."""

    def __init__(self, name, verb, damage, *words):
        self.name, self.verb, self.damage, self.words = name, verb, damage, words


def edited(file, place, value):
    """A JSON file with another value at "a.b.0.c", or without it."""
    def damage(folder):
        path = folder / file
        content = json.loads(path.read_text())
        keys = [int(key) if key.lstrip("-").isdigit() else key for key in place.split(".")]
        parent = content
        for key in keys[:-1]:
            parent = parent[key]
        if value is ABSENT:
            del parent[keys[-1]]
        else:
            parent[keys[-1]] = value
        path.write_text(json.dumps(content))
    return damage


def renamed(file, place, name):
    def damage(folder):
        path = folder / file
        content = json.loads(path.read_text())
        *keys, last = place.split(".")
        parent = content
        for key in keys:
            parent = parent[int(key) if key.isdigit() else key]
        parent[name] = parent.pop(last)
        path.write_text(json.dumps(content))
    return damage


def rewritten(file, change):
    """A file with its bytes changed; None removes it."""
    def damage(folder):
        path = folder / file
        if change is None:
            path.unlink()
        else:
            path.write_bytes(change(path.read_bytes()))
    return damage


def lines(change):
    """Changes the list of lines that are no comments."""
    return lambda content: b"\n".join(change([line for line in content.split(b"\n") if not line.startswith(b"#")]))


def replaced(file, old, new):
    return rewritten(file, lambda content: content.replace(old, new, 1))


def cut(share):
    return lambda content: content[:int(share * len(content))]


# Binary PLY as the programs write it: doubles for meshes, floats for clouds, triangles of a count and three indices.

def ply_body(content):
    return content.index(b"end_header\n") + len(b"end_header\n")


def ply_number(index, value):
    """One coordinate of a cloud."""
    def change(content):
        at = ply_body(content) + 4 * index
        return content[:at] + struct.pack("<f", value) + content[at + 4:]
    return change


def ply_scaled(factor):
    def change(content):
        body = ply_body(content)
        numbers = struct.unpack(f"<{(len(content) - body) // 4}f", content[body:])
        return content[:body] + struct.pack(f"<{len(numbers)}f", *(factor * x for x in numbers))
    return change


def mesh_triangles(change):
    """Changes the list of triangles of a mesh."""
    def apply(content):
        header = content[:ply_body(content)]
        count = int(header.split(b"element vertex ")[1].split()[0])
        faces = int(header.split(b"element face ")[1].split()[0])
        at = len(header) + 24 * count
        triangles = [list(struct.unpack_from("<3i", content, at + 13 * i + 1)) for i in range(faces)]
        change(triangles)
        header = header.replace(b"element face %d" % faces, b"element face %d" % len(triangles))
        return header + content[ply_body(content):at] + b"".join(struct.pack("<B3i", 3, *t) for t in triangles)
    return apply


def vertex_number(index, value):
    def change(content):
        at = ply_body(content) + 8 * index
        return content[:at] + struct.pack("<d", value) + content[at + 8:]
    return change


def png(width, height, bits, rows):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, 0, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(b"".join(b"\0" + row for row in rows))) + chunk(b"IEND", b""))


CAMERA = """image_width: 8
image_height: 6
camera_matrix: {rows: 3, cols: 3, data: [50, 0, 4, 0, 50, 3, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}
"""


def write_sound_files(sysid, sim, folder):
    """asset.json, recording/, cloth.json over mesh.ply (a frame of a run), scene.json, run/ (a search), depth/."""
    asset, recording = program.synthesize(sysid, folder)
    scene = {"schema": "flash-scene/1", "timestep": 0.01, "steps": 2, "gravity": [0, 0, -9.81],
             "obstacles": {"table": {"shape": "plane", "point": [0, 0, -0.1], "normal": [0, 0, 1], "friction": 0.3}},
             "objects": {"cloth": {"asset": "asset.json", "fixed": [{"vertices": [0], "axes": "xz"}],
                                   "loads": [{"vertices": [3], "force": [0, 0, 0.01]}],
                                   "prescribed": [{"vertices": [4],
                                                   "keyframes": [{"t": 0, "translation": [0, 0, 0]},
                                                                 {"t": 1, "translation": [0, 0, 0.1]}]}]}},
             "end_effectors": {"hand": {"size": [0.3, 0.3, 0.05], "keyframes": [{"t": 0, "translation": [0, 0, 0]}],
                                        "grasps": [{"from": 0, "threshold": 0.05}]}},
             "keyframes": [0.01, 0.02]}
    (folder / "scene.json").write_text(json.dumps(scene))
    program.must(sim, "run", folder / "scene.json", "--quiet", "-o", folder / "moved")
    shutil.copy(folder / "moved" / "frames" / "000002.ply", folder / "mesh.ply")
    cloth = copy.deepcopy(program.ASSET) | {"mesh": "mesh.ply"}
    (folder / "cloth.json").write_text(json.dumps(cloth))
    shutil.copytree(recording, folder / "depth")
    (folder / "depth" / "camera.yaml").write_text(CAMERA)
    (folder / "depth" / "depth.png").write_bytes(png(8, 6, 16, [struct.pack(">8H", *[500] * 8)] * 6))
    (folder / "depth" / "mask.png").write_bytes(png(8, 6, 8, [b"\xff" * 8] * 6))
    path = folder / "depth" / "recording.json"
    content = json.loads(path.read_text())
    content["camera"] = {"intrinsics": "camera.yaml", "T_base_camera": [0.1, 0.1, 0.6, 1, 0, 0, 0]}
    content["keyframes"] = [{"t": 0.3, "depth": "depth.png", "mask": "mask.png"}]
    content.pop("crop", None)
    path.write_text(json.dumps(content))
    (folder / "view" / "depth").mkdir(parents=True)
    (folder / "view" / "camera_info.yaml").write_text(CAMERA)
    for frame in range(3):
        shutil.copy(folder / "depth" / "depth.png", folder / "view" / "depth" / f"{frame}.png")
    (folder / "view" / "extrinsics.json").write_text(json.dumps(
        {"schema": "flash-extrinsics/1", "transform": {"parent": "base", "child": "camera", "translation": [0.1, 0.1, 0.6],
                                                       "rotation_xyzw": [1, 0, 0, 0]}}))
    program.must(sysid, "grid", recording, "--asset", asset, "--bending", "5e-5,1e-4,2e-4", "--no-solver-check",
                 "--no-horizon", "--quiet", "-o", folder / "run")


def verbs(sysid, sim):
    """What reads the files: name -> command line in the folder."""
    return {"scene": lambda f: [sim, "run", f / "scene.json", "-o", f / "out"],
            "mesh": lambda f: [sysid, "synth", "--asset", f / "cloth.json", "--kind", "hang", "--duration", "0.1", "-o",
                               f / "out"],
            "asset": lambda f: [sysid, "synth", "--asset", f / "asset.json", "--kind", "corner_lift", "--duration",
                                "0.1", "-o", f / "out"],
            "recording": lambda f: [sysid, "replay", f / "recording", "--asset", f / "asset.json", "-o", f / "out"],
            "depth": lambda f: [sysid, "replay", f / "depth", "--asset", f / "asset.json", "-o", f / "out"],
            "export": lambda f: [sysid, "export", f / "run", "-o", f / "out"],
            "report": lambda f: [sysid, "report", f / "run", "-o", f / "out"],
            **{name: lambda f, value=value: [sysid, "replay", f / "recording", "--asset", f / "asset.json", "--sigma", value,
                                             "-o", f / "out"]
               for name, value in (("unknown term", "torque=1"), ("no number", "force=strong"),
                                   ("not positive", "force=0"), ("not finite", "force=inf"))},
            "resume": lambda f: [sysid, "grid", f / "recording", "--asset", f / "asset.json", "--bending",
                                 "5e-5,1e-4,2e-4", "--no-solver-check", "--no-horizon", "--resume", "-o", f / "run"],
            "import": lambda f: [sysid, "import", f / "recording" / "frames", "--trajectory",
                                 f / "recording" / "gripper.tum", "--times", f / "times.csv", "--mesh", "sheet:0.2x0.2:0.05:alternating", "-o", f / "out"],
            **{" ".join(options): lambda f, options=options: [
                sysid, "import", f / "recording" / "frames", "--trajectory", f / "recording" / "gripper.tum", "--mesh", "sheet:0.2x0.2:0.05:alternating", "-o", f / "out", *options] for options in IMPORT_OPTIONS},
            **{" ".join(("segment", *options)): lambda f, options=options: [
                sysid, "segment", f / "view", "-o", f / "out", *(str(word).replace("{}", str(f)) for word in options)]
               for options in SEGMENT_OPTIONS}}


# What no user can mean, and what the message has to name.
IMPORT_OPTIONS = {("--mesh", "sheet:0.2x0.2:100"): "--mesh", ("--offset-bound", "nan"): "--offset-bound", ("--heading", "inf"): "--heading",
                  ("--times", "rate:0"): "--times", ("--times", "rate:10:1764000000"): "--times",
                  ("--times", "/dev/zero"): "/dev/zero", ("--asset", "nowhere.json"): "--asset",
                  ("--crop-z", "1:0"): "--crop-z"}
SEGMENT_OPTIONS = {("--voxel", "1e-12"): "--voxel", ("--voxel", "nan"): "--voxel", ("--cluster-gap", "50"): "--cluster-gap",
                   ("--arm-radius", "1e9"): "--arm-radius", ("--clearance", "-1"): "--clearance",
                   ("--depth-scale", "1e9"): "--depth-scale", ("--crop-x", "1:0"): "--crop-x",
                   ("--crop-x", "9:"): "table", ("--trajectory", "{}/recording/gripper.tum"): "--times",
                   ("--trajectory", "{}/recording/gripper.tum", "--times", "rate:10:1764000000"): "gripper.tum",
                   ("--times", "{}"): "is a folder", ("--masks", "{}/nowhere"): "nowhere",
                   ("--intrinsics", "{}/pipe"): "pipe", ("--extrinsics", "/dev/zero"): "/dev/zero"}


def asset_cases():
    file, props = "asset.json", "mechanical_props."
    yield Case("asset cut off", "asset", rewritten(file, cut(0.5)), file, "not valid JSON")
    yield Case("asset empty", "asset", rewritten(file, lambda _: b""), file, "not valid JSON")
    yield Case("asset not an object", "asset", rewritten(file, lambda _: b"[1, 2]"), file, "expected an object")
    yield Case("asset of bytes", "asset", rewritten(file, lambda _: bytes(range(256))), file, "not valid JSON")
    yield Case("asset NaN", "asset", edited(file, props + "young", NAN), file, "not valid JSON")
    yield Case("asset of another schema", "asset", edited(file, "schema", "flash-asset/9"), file, "schema")
    yield Case("asset without mesh", "asset", edited(file, "mesh", ABSENT), file, "mesh", "missing")
    yield Case("asset mesh absent", "asset", edited(file, "mesh", "nowhere.obj"), "nowhere.obj")
    yield Case("asset mesh misspelt", "asset", edited(file, "mesh", "sheet:0.2x0.2"), file, "mesh")
    yield Case("asset of too many cells", "asset", edited(file, "mesh", "sheet:1000x1000:0.001"), file, "mesh")
    for field in ("young", "poisson", "constitutive"):
        yield Case(f"asset without {field}", "asset", edited(file, props + field, ABSENT), file, field)
    for field in ("young", "poisson", "friction", "bending_rigidity", "areal_density", "thickness"):
        yield Case(f"asset {field} misspelt", "asset", renamed(file, props + field, field[:-1]), file, field[:-1],
                   f'did you mean "{field}"')
    for field, value in (("young", -1), ("young", 0), ("young", "stiff"), ("poisson", 0.7), ("poisson", -1),
                         ("friction", -0.1), ("areal_density", 0), ("thickness", -0.001), ("bending_rigidity", -1e-5),
                         ("constitutive", "TRI_RUBBER"), ("areal_density", [0.2]), ("air_drag", -1),
                         ("bending_model", "beam")):
        yield Case(f"asset {field} {value}", "asset", edited(file, props + field, value), file, field)
    yield Case("asset with two masses", "asset", edited(file, props + "mass", 0.1), file, "mass")


def scene_cases():
    file = "scene.json"
    yield Case("scene cut off", "scene", rewritten(file, cut(0.7)), file, "not valid JSON")
    cloth = "objects.cloth."
    for place, value, word in (("timestep", 0, "timestep"), ("timestep", "fast", "timestep"),
                               ("gravity", [0, -9.81], "gravity"), ("steps", -1, "steps"), ("steps", 1.5, "steps"),
                               ("keyframes", [0.02, 0.01], "keyframes"), (cloth + "asset", "no.json", "asset"),
                               (cloth + "fixed.0.vertices", [], "vertices"), (cloth + "fixed.0.axes", "w", "axes"),
                               (cloth + "fixed.0.vertices", [400], "400"), (cloth + "fixed.0.vertices", [-1], "vertices"),
                               (cloth + "fixed.0.positions", [[0, 0]], "positions"),
                               (cloth + "loads.0.force", [0, 0], "force"), (cloth + "loads.0.hung_mass", 1, "force"),
                               (cloth + "prescribed.0.keyframes.1.t", 0, "keyframes"),
                               (cloth + "start", "nowhere.ply", "start"), ("objects", {}, "objects"),
                               ("obstacles.table.normal", [0, 0, 0], "normal"),
                               ("obstacles.table.shape", "cone", "shape"), ("obstacles.table.friction", -1, "friction"),
                               ("end_effectors.hand.size", [0.1, 0, 0.1], "size"),
                               ("end_effectors.hand.grasps.0.to", -1, "to"),
                               ("end_effectors.hand.grasps.0.object", "shirt", "object"),
                               ("friction", [{"a": "cloth", "b": "chair", "friction": 0.1}], "friction"),
                               ("solver", {"type": "magic"}, "type"), ("quasistatic", {"motion": 0}, "motion"),
                               ("timestep", ABSENT, "timestep"), ("objects", ABSENT, "objects")):
        what = "missing" if value is ABSENT else json.dumps(value)
        yield Case(f"scene {place} {what}", "scene", edited(file, place, value), file, word)
    yield Case("scene gravity misspelt", "scene", renamed(file, "gravity", "gravty"), file, 'did you mean "gravity"')


def mesh_cases():
    file = "mesh.ply"

    def turn(triangles):
        triangles[3].reverse()

    def flatten(triangles):
        triangles[3][1] = triangles[3][0]

    def point_out(triangles):
        triangles[3][2] = 9999

    for name, damage, words in (
            ("cut off", cut(0.8), ()), ("header cut off", cut(0.05), ("header",)), ("empty", lambda _: b"", ()),
            ("of another kind", lambda _: b"OFF\n3 1 0\n", ("PLY",)),
            ("not finite", vertex_number(7, NAN), ("not finite",)),
            ("infinite", vertex_number(7, float("inf")), ("not finite",)),
            ("triangle flipped", mesh_triangles(turn), ("triangle 3",)),
            ("triangle degenerate", mesh_triangles(flatten), ("triangle 3", "degenerate")),
            ("triangle twice", mesh_triangles(lambda t: t.append(t[0])), ("repeats triangle 0",)),
            ("triangle out of range", mesh_triangles(point_out), ("triangle 3", "9999")),
            ("vertex without a triangle", mesh_triangles(lambda t: t.__delitem__(slice(0, len(t) // 2))), ("vertex",)),
            ("without triangles", mesh_triangles(lambda t: t.clear()), ("no triangles",)),
            ("counts too high", lambda c: c.replace(b"element vertex ", b"element vertex 9", 1), ())):
        yield Case(f"mesh {name}", "mesh", rewritten(file, damage), "mesh.ply", *words)
    yield Case("mesh in millimetres", "mesh", edited("cloth.json", "mesh", "sheet:200x200:50"), "millimetres")


def recording_cases():
    file = "recording/recording.json"
    yield Case("recording cut off", "recording", rewritten(file, cut(0.9)), "recording.json", "not valid JSON")
    yield Case("recording absent", "recording", rewritten(file, None), "recording.json")
    for place, value, word in (
            ("schema", "flash-recording/7", "schema"), ("gravity", [0, 0, "down"], "gravity"),
            ("object.mesh", "sheet:200x200:50", "millimetres"), ("object.mesh", "missing.obj", "missing.obj"),
            ("object.start", {"T_base_object": [0, 0, 0, 0, 0, 0, 2]}, "T_base_object"),
            ("table.normal", [0, 0, 0], "normal"), ("trajectories.gripper", "missing.tum", "missing.tum"),
            ("grasps.0.gripper", "left", "gripper"), ("grasps.0.select", {}, "select"),
            ("grasps.0.select", {"corner": [1, 2]}, "corner"), ("grasps.0.select", {"vertices": [99999]}, "vertices"),
            ("grasps.0.shape", "suction", "shape"), ("grasps.0.to", -5, "to"), ("keyframes", [], "keyframes"),
            ("keyframes.0.t", "soon", "keyframes"), ("keyframes.0.t", 99, "keyframes"),
            ("keyframes.1.t", -9, "keyframes"), ("keyframes.0.cloud", "frames/none.ply", "none.ply"),
            ("keyframes.0", {"t": 0.1}, "keyframes"), ("nuisance", {"offset_m": [-1, 0, 0]}, "offset_m"),
            ("nuisance", {"yaw": 0.1}, "yaw_rad"), ("kind", "dance", "kind"), ("crop", {"min": [0, 0]}, "min"),
            ("crop", {"min": [9, 9, 9], "max": [9.1, 9.1, 9.1]}, "crop"), ("object", ABSENT, "object"),
            ("keyframes", ABSENT, "keyframes"), ("grasps.0.select", {"position": [5, 5, 5]}, "grasps")):
        what = "missing" if value is ABSENT else json.dumps(value)
        yield Case(f"recording {place} {what}", "recording", edited(file, place, value), "recording", word)
    yield Case("recording keyframes misspelt", "recording", renamed(file, "keyframes", "keyframe"), "recording.json",
               'did you mean "keyframes"')


def trajectory_cases():
    file = "recording/gripper.tum"
    swap = lines(lambda text: [text[1], text[0], *text[2:]])
    for name, damage, words in (
            ("times unsorted", swap, ("line",)), ("times twice", lines(lambda t: [t[0], t[0], *t[1:]]), ("line",)),
            ("a number missing", lines(lambda t: [t[0].rsplit(b" ", 1)[0], *t[1:]]), ("line 1",)),
            ("a word", lines(lambda t: [b"a b c d e f g h", *t]), ("line 1",)),
            ("NaN", lines(lambda t: [t[0].split(b" ")[0] + b" nan 0 0 0 0 0 1", *t[1:]]), ("line 1",)),
            ("quaternion not unit", lines(lambda t: [t[0].split(b" ")[0] + b" 0 0 0 0 0 0 2", *t[1:]]), ("quaternion",)),
            ("empty", lambda _: b"", ()), ("in millimetres", lines(lambda t: [scaled_tum(x) for x in t]), ("millimetres",)),
            ("of other times", lines(lambda t: [later(x) for x in t]), ("keyframes",))):
        yield Case(f"trajectory {name}", "recording", rewritten(file, damage), "recording", *words)


def scaled_tum(line):
    words = line.split()
    return b" ".join([words[0], *(b"%.9g" % (1000 * float(w) + 30000) for w in words[1:4]), *words[4:]]) if words else line


def later(line):
    words = line.split()
    return b" ".join([b"%.9g" % (float(words[0]) + 1e6), *words[1:]]) if words else line


def cloud_cases(first):
    file = f"recording/{first}"
    for name, damage, words in (
            ("cut off", cut(0.9), ()), ("header cut off", lambda c: c[:20], ("header",)),
            ("in millimetres", ply_scaled(1000), ("millimetres",)),
            ("of another kind", lambda _: b"# .PCD v0.7\n", ("PLY",)),
            ("of mixed endian", lambda c: c.replace(b"little", b"middle", 1), ("format",)),
            ("property of unknown type", lambda c: c.replace(b"property float", b"property quad", 1), ("type",))):
        yield Case(f"cloud {name}", "recording", rewritten(file, damage), first.split("/")[-1], *words)

    def empty_all(folder):
        for path in (folder / "recording" / "frames").glob("*.ply"):
            path.write_bytes(b"ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
                             b"property float z\nend_header\n")
    yield Case("all clouds empty", "recording", empty_all, "recording", "keyframes")


def camera_cases():
    depth, camera = "depth/depth.png", "depth/camera.yaml"
    for name, file, damage, words in (
            ("depth of 8 bits", depth, lambda _: png(8, 6, 8, [b"\x40" * 8] * 6), ("16-bit",)),
            ("depth cut off", depth, cut(0.6), ()), ("depth no PNG", depth, lambda _: b"JFIF", ()),
            ("depth of another size", depth, lambda _: png(4, 3, 16, [b"\1\1" * 4] * 3), ()),
            ("depth huge", depth, lambda c: c[:16] + struct.pack(">II", 2**31 - 1, 2**31 - 1) + c[24:], ()),
            ("depth of 400 megapixels", depth, lambda _: png(20000, 20000, 16, []),
             ("20,000 x 20,000 pixels", "expected at most")),
            ("camera of no focal length", camera, lambda c: c.replace(b"[50", b"[1e-300", 1).replace(b", 50,", b", 1e-300,", 1),
             ("pixels become points",)),
            ("mask of another size", "depth/mask.png", lambda _: png(4, 3, 8, [b"\xff" * 4] * 3), ()),
            ("mask cut off", "depth/mask.png", cut(0.6), ()),
            ("camera no YAML", camera, lambda _: b"{[", ()), ("camera empty", camera, lambda _: b"", ()),
            ("camera matrix of 8", camera, lambda c: c.replace(b", 1]", b"]", 1), ("camera_matrix",)),
            ("camera focal length negative", camera, lambda c: c.replace(b"[50", b"[-50", 1), ("camera_matrix",)),
            ("camera width missing", camera, lambda c: c.replace(b"image_width", b"image_with", 1), ("image_width",)),
            ("camera width a word", camera, lambda c: c.replace(b": 8", b": wide", 1), ("image_width",)),
            ("camera of an unknown model", camera, lambda c: c.replace(b"plumb_bob", b"fisheye", 1),
             ("distortion_model",))):
        # Sizes that differ are found in the image, and named with its mask.
        named = {"mask of another size": "its mask", "camera of no focal length": "depth.png"}.get(
            name, pathlib.Path(file).name)
        yield Case(name, "depth", rewritten(file, damage), named, *words)


def result_cases():
    for verb in ("export", "report"):
        yield Case(f"{verb}: summary cut off", verb, rewritten("run/summary.json", cut(0.5)), "summary.json")
        yield Case(f"{verb}: summary of another schema", verb, edited("run/summary.json", "schema", "x/1"),
                   "summary.json", "schema")
    yield Case("report: results of a word", "report", replaced("run/results.csv", b"\n0,", b"\nzero,"), "results.csv",
               "id")
    yield Case("report: results without a column", "report", replaced("run/results.csv", b"score_m", b"score"),
               "results.csv", "score_m")
    yield Case("report: unknown status", "report", replaced("run/results.csv", b",ok,", b",fine,"), "results.csv",
               "status")
    yield Case("report: grid cut off", "report", rewritten("run/grid.json", cut(0.5)), "grid.json")
    yield Case("resume: another step", "resume", edited("run/grid.json", "fingerprint.time_step_s", "0.005"), "--resume",
               "time_step_s was 0.005 and is 0.01")
    yield Case("resume: another asset", "resume", edited("asset.json", "mechanical_props.friction", 0.31), "--resume",
               "asset friction was 0.3 and is 0.31")


def import_cases():
    def times(text):
        return lambda folder: (folder / "times.csv").write_bytes(text)
    for name, text in (("times without a column t", b"a,b\n1,2\n"), ("times too few", b"t\n0\n0.1\n"),
                       ("times empty", b""), ("times a word", b"t\n0\nnow\n"), ("times NaN", b"t\n0\nnan\n")):
        yield Case(name, "import", times(text), "times.csv")


    def pipe(folder):
        (folder / "recording" / "gripper.tum").unlink()
        os.mkfifo(folder / "recording" / "gripper.tum")
    yield Case("trajectory a pipe", "import", pipe, "gripper.tum", "pipe")
    yield Case("trajectory of one line", "import",
               lambda folder: (folder / "recording/gripper.tum").write_text("0 0 0 0 0 0 0 1\n"), "--trajectory", "one pose")
    for options, word in IMPORT_OPTIONS.items():
        name = " ".join(options)
        yield Case(f"import {name}", name, lambda folder: None, word)


def segment_cases():
    for options, word in SEGMENT_OPTIONS.items():
        name = " ".join(("segment", *options))
        yield Case(name, name, lambda folder: os.mkfifo(folder / "pipe"), word)


def deep_cases():
    deep = b"[" * 80000 + b"]" * 80000
    for verb, file in (("asset", "asset.json"), ("scene", "scene.json"), ("recording", "recording/recording.json"),
                       ("report", "run/summary.json"), ("report", "run/grid.json")):
        yield Case(f"{file} nested too deeply", verb, rewritten(file, lambda _: deep), pathlib.Path(file).name, "nesting")


def option_cases():
    for name in ("unknown term", "no number", "not positive", "not finite"):
        yield Case(f"--sigma: {name}", name, lambda folder: None, "--sigma")


def all_cases(first_frame):
    for cases in (asset_cases(), scene_cases(), mesh_cases(), recording_cases(), trajectory_cases(),
                  cloud_cases(first_frame), camera_cases(), result_cases(), import_cases(),
                  segment_cases(), deep_cases(), option_cases()):
        yield from cases


def complaint(case, commands, sound, work):
    """What is wrong with how the program took the damage; empty where nothing is."""
    folder = work / "damaged"
    program.renew(sound, folder)
    case.damage(folder)
    entries = set(folder.rglob("*"))
    files = {path: path.read_bytes() for path in entries if path.is_file()}
    done = program.call(*commands[case.verb](folder), "--quiet")
    text = done.stderr.rstrip("\n")
    if done.returncode != 2:
        return f"exit code {done.returncode}, expected 2: {text[-2000:]}"
    if not text or "\n" in text:
        return f"not one line: {text}"
    missing = [word for word in case.words if word not in text]
    if missing:
        return f"does not name {missing}: {text}"
    left = set(folder.rglob("*")) - entries
    if left:
        return f"left {sorted(str(path) for path in left)[:3]} behind"
    changed = [path.name for path, content in files.items() if not path.exists() or path.read_bytes() != content]
    return f"changed {changed}" if changed else ""


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sysid", required=True, help="the program flash-sysid")
    parser.add_argument("--sim", required=True, help="the program flash-sim")
    parser.add_argument("--only", default="", help="cases whose name has this")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        work = pathlib.Path(temporary)
        write_sound_files(options.sysid, options.sim, work / "sound")
        first = json.loads((work / "sound/recording/recording.json").read_text())["keyframes"][0]["cloud"]
        commands = verbs(options.sysid, options.sim)
        cases = [case for case in all_cases(first) if options.only in case.name]
        failed = 0
        for case in cases:
            wrong = complaint(case, commands, work / "sound", work)
            failed += bool(wrong)
            if wrong:
                print(f"{case.name}: {wrong}", flush=True)
        print(f"{len(cases) - failed} of {len(cases)} malformed inputs refused in one line that names file and field")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
