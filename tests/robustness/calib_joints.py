#!/usr/bin/env python3
"""An arm whose links are not as its URDF says: handeye --link-lengths finds those that pictures tell, export --joint-origins writes
them, and the file's own forward kinematics, computed here, is that of the answer. Misuse is refused by name.

The arm is a gantry with a wrist of three axes about z, y and x, apart from each other: its joints follow from a pose in closed form."""
import argparse
import csv
import json
import math
import pathlib
import sys
import tempfile
import xml.etree.ElementTree as xml

import program
from calib_exports import near, numbers, product, rotation_of_joint

AXES = {"rail_x": (1, 0, 0), "rail_y": (0, 1, 0), "rail_z": (0, 0, 1), "yaw": (0, 0, 1), "pitch": (0, 1, 0), "roll": (1, 0, 0)}
DESCRIBED = {"pitch": (0.1, 0, 0), "roll": (0.08, 0, -0.05), "flange": (0.06, 0, 0)}
SHORTER = {"pitch": (0.0008, 0, 0), "roll": (0, -0.0006, 0.0007)}  # than it is [m]
ENDS = ["base", "slide_x", "slide_y", "column", "turret", "knuckle", "hand", "tool0"]


def urdf():
    lines = ['<?xml version="1.0"?>', '<robot name="gantry">', *(f'  <link name="{link}"/>' for link in ENDS)]
    for parent, child, name in zip(ENDS, ENDS[1:], [*AXES, "flange"]):
        kind = "fixed" if name == "flange" else "prismatic" if name.startswith("rail") else "continuous"
        origin = f'<origin xyz="{" ".join(map(str, DESCRIBED[name]))}"/>' if name in DESCRIBED else ""
        axis = f'<axis xyz="{" ".join(map(str, AXES[name]))}"/>' if name in AXES else ""
        lines.append(f'  <joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{origin}{axis}</joint>')
    return "\n".join([*lines, "</robot>", ""])


def times(R, v):
    return [sum(a * b for a, b in zip(row, v)) for row in R]


def plus(a, b):
    return [x + y for x, y in zip(a, b)]


def about(axis, angle):
    return rotation_of_joint([angle * a for a in axis])  # of one axis alone


def joints_of(R, t):
    """Of the arm as it is, for R = Rz(yaw) Ry(pitch) Rx(roll)."""
    yaw, pitch, roll = math.atan2(R[1][0], R[0][0]), math.asin(-R[2][0]), math.atan2(R[2][1], R[2][2])
    true = {name: plus(DESCRIBED[name], SHORTER.get(name, (0, 0, 0))) for name in DESCRIBED}
    Rz = about((0, 0, 1), yaw)
    offset = plus(times(Rz, true["pitch"]), plus(times(product(Rz, about((0, 1, 0), pitch)), true["roll"]), times(R, true["flange"])))
    return [*(a - b for a, b in zip(t, offset)), yaw, pitch, roll]


def forward(text, q):
    """Of a URDF, from its first link to its last: rotation and translation."""
    joints = {joint.find("parent").get("link"): joint for joint in xml.fromstring(text).iter("joint")}
    R, t, link, next_q = [[1, 0, 0], [0, 1, 0], [0, 0, 1]], [0, 0, 0], ENDS[0], iter(q)
    while link != ENDS[-1]:
        joint = joints[link]
        origin = joint.find("origin")
        attribute = lambda name: numbers(origin.get(name, "0 0 0")) if origin is not None else [0, 0, 0]
        t = plus(t, times(R, attribute("xyz")))
        R = product(R, rotation_of_joint(attribute("rpy")))
        if joint.get("type") != "fixed":
            axis, value = numbers(joint.find("axis").get("xyz")), next(next_q)
            if joint.get("type") == "prismatic":
                t = plus(t, times(R, [value * a for a in axis]))
            else:
                R = product(R, about(axis, value))
        link = joint.find("child").get("link")
    return R, t


def as_answered(answer, q):
    """The same of the described arm at q and the zeros of the answer, with its lengths."""
    solved = answer["joint_zeros"]
    zeros = {name: slid / 1e3 if turned is None else math.radians(turned)
             for name, turned, slid in zip(solved["joints"], solved["estimate_deg"], solved["estimate_mm"], strict=True)}
    lengths = answer["link_lengths"]
    R, t = [[1, 0, 0], [0, 1, 0], [0, 0, 1]], [0, 0, 0]
    for name, value in zip([*AXES, "flange"], [*q, 0]):
        origin = list(DESCRIBED.get(name, (0, 0, 0)))
        for joint, direction, estimate in zip(lengths["joints"], lengths["directions"], lengths["estimate_mm"], strict=True):
            if joint == name:
                origin = plus(origin, [estimate / 1e3 * d for d in direction])
        t = plus(t, times(R, origin))
        if name in AXES:
            at = value + zeros[name]
            if name.startswith("rail"):
                t = plus(t, times(R, [at * a for a in AXES[name]]))
            else:
                R = product(R, about(AXES[name], at))
    return R, t


def recording(tool, folder):
    """A drawn recording whose poses are joints of the arm; the joints."""
    program.must(tool, folder, "eye-in-hand", "chessboard:9x6:0.025", 25, "640x480", "0.003", "0.02", 7)
    q = []
    for line in (folder / "poses.tum").read_text().splitlines():
        if line.startswith("#"):
            continue
        stamp, *pose = numbers(line)
        q.append((int(stamp), joints_of(program.rotation_of(pose[3:]), pose[:3])))
    with open(folder / "joints.csv", "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["index", *AXES])
        writer.writerows([index, *map(repr, values)] for index, values in q)
    return [values for _, values in q]


def check(calib, work, tool):
    q = recording(tool, work / "set")
    robot = work / "gantry.urdf"
    robot.write_text(urdf())
    given = ("handeye", work / "set", "--poses", work / "set/joints.csv", "--robot", robot, "--cache", work / "cache")
    file = work / "answer.json"
    shown = program.must(calib, *given, "--link-lengths", "0.5", "-o", file).stdout
    answer = json.loads(file.read_text())
    lengths = answer["link_lengths"]
    yield lengths["prior_sd_mm"] == 0.5, f"the prior is {lengths['prior_sd_mm']} mm"
    told = {}
    for joint, direction, estimate, interval, is_told in zip(*(lengths[key] for key in ("joints", "directions", "estimate_mm", "interval_mm",
                                                                                         "told")), strict=True):
        truth = 1e3 * sum(a * b for a, b in zip(direction, SHORTER.get(joint, (0, 0, 0))))
        axis = "xyz"[[abs(d) for d in direction].index(1)]
        yield f"{joint} along {axis}" in shown, f"{joint} along {axis} is not printed:\n{shown}"
        wide = interval[1] - interval[0]  # four standard deviations, nearly
        yield not is_told or abs(estimate - truth) < wide, f"{joint} along {axis}: {estimate} {interval}, truth {truth}"
        if is_told:
            told[joint, axis] = estimate
    yield told.keys() == {("pitch", "x"), ("roll", "y"), ("roll", "z")}, f"told are {sorted(told)}"
    into = ("export", file, "--to", "urdf", "--into", robot, "--parent-frame", "tool0", "--child-frame", "eye", "--joint-origins")
    done = program.must(calib, *into)
    yield "joints" not in done.stdout, f"export --joint-origins: {done.stdout}"
    corrected = robot.read_text()
    yield (work / "gantry.urdf.bak").read_text() == urdf(), "the backup is not the file as it was"
    for values in q:
        (R, t), (Rw, tw) = forward(corrected, values), as_answered(answer, values)
        yield near(R, Rw, 1e-7) and near(t, tw, 1e-7), f"at {values} the file has {t}, the answer {tw}"
    program.must(calib, *into)
    yield robot.read_text() == corrected, "a second export changed the file"
    # Without the option the file says less than the transform needs.
    robot.write_text(urdf())
    yield "joints and links are off" in program.must(calib, *into[:-1]).stdout, "export says nothing of the joints that it leaves"
    usual = json.loads(program.must(calib, *given, "--link-lengths", "usual", "--json").stdout)
    yield usual["link_lengths"]["prior_sd_mm"] == 0.3, "usual is not 0.3 mm"
    zeros_alone = json.loads(program.must(calib, *given, "-o", work / "zeros.json", "--json").stdout)
    origins = [origin["joint"] for origin in zeros_alone["joint_origins"]]
    yield zeros_alone["link_lengths"] is None and origins == [*AXES, "flange"], f"lengths without --link-lengths, or origins of {origins} alone"
    yield from refused(calib, work, given, into, file, robot)


def refused(calib, work, given, into, file, robot):
    other = work / "other.urdf"
    other.write_text(urdf().replace('"pitch"', '"tilt"'))
    moved = work / "moved.urdf"
    moved.write_text(urdf().replace('"0.1 0 0"', '"0.12 0 0"'))
    (work / "named.csv").write_text((work / "set/joints.csv").read_text().replace("pitch", "tilt", 1))
    poses = work / "of_poses.json"
    program.must(calib, "handeye", work / "set", "-o", poses, "--cache", work / "cache")
    with_file = lambda path: (*into[:5], path, *into[6:])
    for words, expected in (((*given, "--link-lengths", "-0.3"), "--link-lengths"),
                            ((*given, "--link-lengths", "0"), 'found "0", expected usual, or 0.001 to 50 millimetres'),
                            ((*given, "--link-lengths", "1e-160"), 'found "1e-160", expected usual, or 0.001 to 50 millimetres'),
                            ((*given, "--link-lengths", "nan"), 'found "nan"'),
                            ((*given, "--link-lengths", "500"), "0.001 to 50"),
                            (("handeye", work / "set", "--link-lengths", "0.3"), "--robot"),
                            ((*given[:3], work / "named.csv", *given[4:], "--link-lengths", "0.3"), "found no column of joint pitch"),
                            (with_file(other), "joint pitch: found it 0 times"),
                            (with_file(moved), "joint pitch: found origin 0.12 0 0"),
                            (("export", poses, *into[2:]), "joint_origins: found none"),
                            (("export", file, "--to", "xacro", *into[4:]), "--joint-origins: found --to xacro"),
                            (("export", file, "--to", "urdf", "-o", work / "a.urdf", "--joint-origins"), "--joint-origins: found no --into")):
        before = sorted(path.name for path in work.iterdir()) + [path.read_text() for path in (robot, other, moved)]
        done = program.call(calib, *words)
        after = sorted(path.name for path in work.iterdir()) + [path.read_text() for path in (robot, other, moved)]
        yield done.returncode == 2 and expected in done.stderr and done.stderr.count("\n") == 1, \
            f"{list(map(str, words))}: {done.returncode} {done.stderr!r}, expected {expected!r}"
        yield before == after, f"{list(map(str, words))}: something was written"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--calib", required=True, help="the program flash-calib")
    parser.add_argument("--draw", required=True, help="the program rendered_dataset")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        return program.conclude(list(check(options.calib, pathlib.Path(folder), options.draw)))


if __name__ == "__main__":
    sys.exit(main())
