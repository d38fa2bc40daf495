#!/usr/bin/env python3
"""Each file of flash-calib export says the transform and the lens of the calibration, as its reader reads it. MuJoCo and OpenUSD
judge theirs where their packages (mujoco, usd-core) are there."""
import argparse
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as xml

import program

ROBOT = """<?xml version="1.0"?>
<!-- a robot
     of two links -->
<robot name="r">
  <link name="base"/>
  <link name="tool0" />
  <joint name="j" type="revolute"><parent link="base"/><child link="tool0"/><axis xyz="0 0 1"/></joint>
</robot>
"""
MODEL = """<mujoco>
  <worldbody>
    <!-- <body name="tool0"> is below -->
    <body name="base">
      <geom size="0.1"/>
      <body name="tool0" pos="0.1 0.2 0.3">
        <joint axis="0 0 1"/><geom size="0.01"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(len(b))) for j in range(len(b[0]))] for i in range(len(a))]


def near(a, b, most=1e-6):
    flat = lambda value: [x for item in value for x in flat(item)] if isinstance(value, (list, tuple)) else [value]
    return all(abs(x - y) < most for x, y in zip(flat(a), flat(b), strict=True))


def numbers(text):
    return [float(word) for word in text.split()]


def rotation_of_joint(rpy):
    r, p, w = rpy
    about = lambda a, i, j: [[math.cos(a) if k == m and k in (i, j) else float(k == m) if k not in (i, j) or m not in (i, j)
                              else (-math.sin(a) if (k, m) == (i, j) else math.sin(a)) for m in range(3)] for k in range(3)]
    return product(about(w, 0, 1), product(about(p, 2, 0), about(r, 1, 2)))


def of_urdf(calib, work, truth):
    t, R = truth["t"], truth["R"]
    robot = work / "robot.urdf"
    robot.write_text(ROBOT)
    into = ("export", truth["file"], "--to", "urdf", "--into", robot, "--parent-frame", "tool0", "--child-frame", "eye")
    program.must(calib, *into)
    once = robot.read_text()
    yield (work / "robot.urdf.bak").read_text() == ROBOT, "urdf: the backup is not the file as it was"
    yield once.replace(re.search(r"\n  <!-- flash-calib: eye -->.*<!-- end of flash-calib: eye -->", once, re.S)[0], "") == ROBOT, \
        "urdf: more than the camera changed"
    joints = {joint.find("child").get("link"): joint for joint in xml.fromstring(once).iter("joint")}
    origin = joints["eye"].find("origin")
    yield joints["eye"].find("parent").get("link") == "tool0", "urdf: the camera is not on tool0"
    yield near(numbers(origin.get("xyz")), t) and near(rotation_of_joint(numbers(origin.get("rpy"))), R), "urdf: another transform"
    program.must(calib, *into)
    yield robot.read_text() == once, "urdf: the camera is there twice"
    yield (work / "robot.urdf.bak2").read_text() == once, "urdf: the first backup did not stay alone"
    program.must(calib, "export", truth["file"], "--to", "xacro", "-o", work / "eye.xacro")
    yield "<link name=" in (work / "eye.xacro").read_text(), "xacro: no link"


def of_mjcf(calib, work, truth):
    robot = work / "robot.xml"
    robot.write_text(MODEL)
    program.must(calib, "export", truth["file"], "--to", "mjcf", "--into", robot, "--parent-frame", "tool0", "--child-frame", "eye")
    text = robot.read_text()
    camera = next(body for body in xml.fromstring(text).iter("body") if body.get("name") == "tool0").find("camera")
    yield camera is not None, "mjcf: the camera is not in the body"
    w, x, y, z = numbers(camera.get("quat"))
    backwards = [[1, 0, 0], [0, -1, 0], [0, 0, -1]]
    yield near(numbers(camera.get("pos")), truth["t"]) and near(product(program.rotation_of((x, y, z, w)), backwards), truth["R"]), \
        "mjcf: another transform"
    try:
        import mujoco
    except ImportError:
        print("mujoco is not there: its word on the lens is left out")
        return
    import numpy
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    scene, view = mujoco.MjvScene(model, 10), mujoco.MjvCamera()
    view.type, view.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, 0
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, view, mujoco.mjtCatBit.mjCAT_ALL, scene)
    gl = scene.camera[0]
    # OpenGL's frustum: left, right, bottom, top at frustum_near.
    width = gl.frustum_width
    left, right = gl.frustum_center - width, gl.frustum_center + width
    lens = truth["lens"]
    (wide, high), (fx, fy), (cx, cy) = lens["size_px"], lens["focal_px"], lens["centre_px"]
    expected = [-(cx + 0.5) / fx, (wide - 0.5 - cx) / fx, -(high - 0.5 - cy) / fy, (cy + 0.5) / fy]
    found = [v / gl.frustum_near for v in (left, right, gl.frustum_bottom, gl.frustum_top)]
    yield near(found, expected, 1e-5), f"mjcf: MuJoCo sees {found}, the lens {expected}"
    place = numpy.array(truth["t"]) + [0.1, 0.2, 0.3]
    yield near(list(map(float, data.cam_xpos[0])), list(map(float, place))), "mjcf: MuJoCo has the camera elsewhere"


def of_usd(calib, work, truth):
    program.must(calib, "export", truth["file"], "--to", "usd", "-o", work / "eye.usda")
    try:
        from pxr import Gf, Usd, UsdGeom
    except ImportError:
        print("usd-core is not there: its word is left out")
        return
    stage = Usd.Stage.Open(str(work / "eye.usda"))
    prim = next(p for p in stage.Traverse() if p.IsA(UsdGeom.Camera))
    camera = UsdGeom.Camera(prim).GetCamera(Usd.TimeCode.Default())
    frustum = camera.frustum
    lens = truth["lens"]
    (fx, fy), (cx, cy), (wide, high) = lens["focal_px"], lens["centre_px"], lens["size_px"]
    # A point of the camera's optical frame, where a pinhole sees it, and where USD does.
    point = (0.11, -0.07, 0.9)
    world = [sum(truth["R"][i][k] * point[k] for k in range(3)) + truth["t"][i] for i in range(3)]
    seen = (frustum.ComputeViewMatrix() * frustum.ComputeProjectionMatrix()).Transform(Gf.Vec3d(*world))
    pixel = ((seen[0] + 1) / 2 * wide - 0.5, (1 - seen[1]) / 2 * high - 0.5)
    expected = (fx * point[0] / point[2] + cx, fy * point[1] / point[2] + cy)
    yield near(list(pixel), list(expected), 1e-2), f"usd: sees a point at {pixel}, the lens at {expected}"
    yield UsdGeom.GetStageMetersPerUnit(stage) == 1 and UsdGeom.GetStageUpAxis(stage) == "Z", "usd: other units or axes"


def odd_files(calib, work, truth):
    """Links are followed, permissions stay, and what only looks like the end of a robot is none."""
    target, link = work / "target.urdf", work / "link.urdf"
    target.write_text(ROBOT + "<!-- was: <robot></robot> -->\n")
    target.chmod(0o640)
    link.symlink_to(target.name)
    into = ("export", truth["file"], "--to", "urdf", "--into", link, "--parent-frame", "tool0", "--child-frame", "eye")
    program.must(calib, *into)
    yield link.is_symlink() and "flash-calib: eye" in target.read_text(), "urdf: a link was replaced"
    yield target.stat().st_mode & 0o777 == 0o640, "urdf: other permissions"
    yield xml.fromstring(target.read_text()).find("link[@name='eye']") is not None, "urdf: the camera is in a comment"
    long = "a" * 300
    program.must(calib, "export", truth["file"], "--to", "urdf", "-o", work / "long.urdf", "--parent-frame", long, "--child-frame", "b" * 300)
    yield xml.fromstring((work / "long.urdf").read_text()).find("joint/parent").get("link") == long, "urdf: a long name is cut"
    model = work / "cdata.xml"
    model.write_text(MODEL.replace("<worldbody>", "<custom><![CDATA[ <body name='q'> ]]></custom><worldbody>"))
    program.must(calib, "export", truth["file"], "--to", "mjcf", "--into", model, "--parent-frame", "tool0", "--child-frame", "eye")
    carrier = next(body for body in xml.fromstring(model.read_text()).iter("body") if body.get("name") == "tool0")
    yield carrier.find("camera") is not None, "mjcf: the camera is in another body"


def at_once(calib, work, truth):
    """Exports into one file at the same time lose no camera, and what one of them kept is what stood there."""
    robot, cameras = work / "shared.urdf", [f"eye_{k}" for k in range(8)]
    robot.write_text(ROBOT)
    calls = [subprocess.Popen([calib, "export", truth["file"], "--to", "urdf", "--into", robot, "--parent-frame", "tool0", "--child-frame", camera],
                              stdout=subprocess.DEVNULL) for camera in cameras]
    yield all(call.wait() == 0 for call in calls), "urdf: exports at once fail"
    found = [link.get("name") for link in xml.fromstring(robot.read_text()).iter("link")]
    yield sorted(found) == sorted(["base", "tool0", *cameras]), f"urdf: of {len(cameras)} exports at once {found} are left"
    yield len(list(work.glob("shared.urdf.bak*"))) == len(cameras), "urdf: exports at once share a backup"


def refused(calib, work, truth):
    robot, model = work / "other.urdf", work / "other.xml"
    robot.write_text(ROBOT)
    model.write_text(MODEL)
    file = truth["file"]
    twice = work / "twice.urdf"
    twice.write_text(ROBOT.replace("</robot>", '<link name="tool0"/></robot>'))
    for words, expected in (
            (("--to", "urdf", "--into", robot), 'expected "' + truth["parent"] + '"'),
            (("--to", "urdf", "--into", robot, "--parent-frame", "tool0", "--child-frame", "base"), "flash-calib did not write"),
            (("--to", "mjcf", "--into", model, "--parent-frame", "hand"), "found base, tool0"),
            (("--to", "mjcf", "--into", robot, "--parent-frame", "tool0"), "found <robot>, expected <mujoco>"),
            (("--to", "urdf", "--into", file, "--parent-frame", "tool0"), "is no XML"),
            (("--to", "tf", "--into", robot), "expected urdf, xacro or mjcf"),
            (("--to", "tf"), "found neither"),
            (("--to", "tf", "--into", robot, "-o", work / "a"), "found both"),
            (("--to", "tf", "-o", file, "--force"), "extrinsics"),
            (("--to", "step", "-o", work / "a"), "--to"),
            (("--to", "tf", "-o", work / "a", "--child-frame", "a b"), "--child-frame"),
            (("--to", "urdf", "--into", robot, "--parent-frame", "tool0", "--child-frame", "eye--1"), "two hyphens"),
            (("--to", "urdf", "--into", twice, "--parent-frame", "tool0"), '"tool0" 2 times'),
            (("--to", "urdf", "--into", "/dev/null", "--parent-frame", "tool0"), "/dev/null"),
            (("--to", "urdf", "--into", work / "none.urdf"), "none.urdf")):
        before = sorted(p.name for p in work.iterdir()), robot.read_text(), model.read_text(), pathlib.Path(file).read_text()
        done = program.call(calib, "export", file, *words)
        after = sorted(p.name for p in work.iterdir()), robot.read_text(), model.read_text(), pathlib.Path(file).read_text()
        yield done.returncode == 2 and expected in done.stderr and done.stderr.count("\n") == 1, \
            f"{words}: {done.returncode} {done.stderr!r}, expected {expected!r}"
        yield before == after, f"{words}: something was written"
    partial = work / "partial.json"
    partial.write_text(json.dumps(json.loads(pathlib.Path(file).read_text()) | {
        "one_axis": {"told": False, "camera_axis": [0, 0, 1], "camera_m": 0, "target_axis": [0, 0, 1], "target_m": 0, "measured": None}}))
    for kind in ("urdf", "xacro", "tf", "mjcf", "usd", "easy_handeye2", "opencv"):
        done = program.call(calib, "export", partial, "--to", kind, "-o", work / "of_partial")
        yield done.returncode == 2 and "one_axis.told: found false" in done.stderr and done.stderr.count("\n") == 1 \
            and not (work / "of_partial").exists(), f"a partial answer as {kind}: {done.returncode} {done.stderr!r}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--calib", required=True, help="the program flash-calib")
    parser.add_argument("--draw", required=True, help="the program rendered_dataset")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        program.must(options.draw, work / "set", "eye-in-hand", "chessboard:9x6:0.025", 12, "640x480", "0.02", "0.2", 1)
        file = work / "extrinsics.json"
        program.must(options.calib, "handeye", work / "set", "-o", file)
        answer = json.loads(file.read_text())
        transform = answer["transform"]
        truth = {"file": file, "t": transform["translation"], "R": program.rotation_of(transform["rotation_xyzw"]), "lens": answer["lens"],
                 "parent": transform["parent"]}
        results = [row for check in (of_urdf, of_mjcf, of_usd, odd_files, at_once, refused) for row in check(options.calib, work, truth)]
        for kind in ("tf", "easy_handeye2", "opencv"):
            done = program.must(options.calib, "export", file, "--to", kind, "-o", work / kind, "--json")
            results.append((json.loads(done.stdout)["file"] == str(work / kind) and (work / kind).exists(), f"{kind}: not written"))
        return program.conclude(results)


if __name__ == "__main__":
    sys.exit(main())
