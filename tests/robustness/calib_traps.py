#!/usr/bin/env python3
"""Spoils a drawn recording in the ways in which people spoil them, and calibrates it with the program: each must be
handled, with the right answer and a warning that says what was done, or be refused with exit code 2 or 3 and one
sentence that names the cause."""
import argparse
import json
import math
import os
import pathlib
import pty
import random
import re
import shutil
import subprocess
import sys
import tempfile
import threading

import png
import program
from tum_poses import conjugate, inverted, multiply, read_poses, rotate, write_poses

BOARD, PLAIN = "chessboard:9x6:0.025", "chessboard:8x6:0.025"  # 8 x 6 looks the same after half a turn
SIGMAS = 4.5  # of six components: beyond it one correct answer in 25,000


def jolted(pose, rng):
    """5 cm and 6 degrees off."""
    axis = [rng.gauss(0, 1) for _ in range(3)]
    length = math.sqrt(sum(a * a for a in axis))
    q = [*(math.sin(0.05) * a / length for a in axis), math.cos(0.05)]
    return [pose[0], *(x + rng.choice((-0.05, 0.05)) for x in pose[1:4]), *multiply(pose[4:], q)]


def roll_pitch_yaw(q):
    x, y, z, w = q
    return (math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
            math.asin(max(-1, min(1, 2 * (w * y - z * x)))),
            math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))


def turning_xyz(q):
    """Angles about turning x, y, z, as Staubli's: R = Rx Ry Rz."""
    x, y, z, w = q
    return (math.atan2(2 * (w * x - y * z), 1 - 2 * (x * x + y * y)),
            math.asin(max(-1, min(1, 2 * (w * y + x * z)))),
            math.atan2(2 * (w * z - x * y), 1 - 2 * (y * y + z * z)))


def turning_zyz(q):
    """Angles about turning z, y, z, as Kawasaki's: R = Rz Ry Rz."""
    x, y, z, w = q
    return (math.atan2(y * z - w * x, x * z + w * y), math.acos(max(-1, min(1, 1 - 2 * (x * x + y * y)))),
            math.atan2(y * z + w * x, w * y - x * z))


def rotation_vector(q):
    x, y, z, w = q if q[3] >= 0 else [-c for c in q]
    length = math.sqrt(x * x + y * y + z * z)
    return [2 * math.atan2(length, w) / max(length, 1e-12) * c for c in (x, y, z)]


# Ways to spoil a recording. Each changes the folder and returns options for the command line.

def poses_changed(change):
    def spoil(folder):
        path = folder / "poses.tum"
        write_poses(path, change(read_poses(path)))
        return []
    return spoil


def swapped_setup(folder):
    said = json.loads((folder / "target.json").read_text())["setup"]
    return ["--setup", "eye-to-hand" if said == "eye-in-hand" else "eye-in-hand"]


def shifted(poses):
    return [poses[0]] + [[later[0], *earlier[1:]] for earlier, later in zip(poses, poses[1:])]


def millimetres(poses):
    return [[p[0], *(1000 * x for x in p[1:4]), *p[4:]] for p in poses]


def backwards(poses):
    return [[pose[0], *place[1:]] for pose, place in zip(poses, reversed(poses))]


def w_first(poses):
    """Quaternions as w x y z, where x y z w is read."""
    return [[*pose[:4], pose[7], *pose[4:7]] for pose in poses]


def longer_quaternions(poses):
    return [[*pose[:4], *(1.2 * x for x in pose[4:])] for pose in poses]


def with_no_number(poses):
    return [*poses[:4], [poses[4][0], math.nan, *poses[4][2:]], *poses[5:]]


def at_one_place(poses):
    return [[pose[0], *poses[0][1:]] for pose in poses]


def one_moved(poses):
    """The sixth pose is 50 mm off."""
    return [[pose[0], pose[1] + (0.05 if i == 5 else 0), *pose[2:]] for i, pose in enumerate(poses)]


def some_jolted(poses):
    rng = random.Random(7)
    return [jolted(pose, rng) if i % 3 == 1 and i < 15 else pose for i, pose in enumerate(poses)]


def as_angles(columns, unit, backwards=False, length=1, angles=roll_pitch_yaw):
    """Poses as three angles under the given names, multiplied by `unit`; roll, pitch and yaw backwards as KUKA writes them.
    Without names: bare numbers, in the order of the pictures."""
    def spoil(folder):
        rows = [f"index,tx,ty,tz,{columns}"] if columns else []
        for pose in read_poses(folder / "poses.tum"):
            turn = [unit * angle for angle in angles(pose[4:])]
            if backwards:
                turn.reverse()
            if not columns:
                rows.append(",".join(f"{value:.10g}" for value in (*(length * x for x in pose[1:4]), *turn)))
                continue
            rows.append(",".join(f"{value:.10g}" for value in (int(pose[0]), *pose[1:4], *turn)))
        (folder / "poses.tum").unlink()
        (folder / "poses.csv").write_text("\n".join(rows) + "\n")
        return []
    return spoil


def shuffled(poses):
    """Each picture beside the pose of another."""
    places = [pose[1:] for pose in poses]
    random.Random(5).shuffle(places)
    return [[pose[0], *place] for pose, place in zip(poses, places)]


def knocked_before(picture):
    """The camera in the hand moves by 8 mm before that picture, which looks as if the gripper had moved."""
    def knocked(poses):
        return [pose if i >= picture else
                [pose[0], *(x + y for x, y in zip(pose[1:4], rotate(pose[4:], (0.006, -0.004, 0.0035)))), *pose[4:]]
                for i, pose in enumerate(poses)]
    return knocked


def drifting(poses):
    """The camera in the hand slips by 10 mm from the first picture to the last."""
    last = len(poses) - 1
    return [[pose[0], *(x + (i / last - 1) * y for x, y in zip(pose[1:4], rotate(pose[4:], (0.0075, -0.005, 0.0043)))),
             *pose[4:]] for i, pose in enumerate(poses)]


def first_views(count):
    def spoil(folder):
        for image in sorted((folder / "images").iterdir())[count:]:
            image.unlink()
        return []
    return spoil


def copied(folder):
    poses = read_poses(folder / "poses.tum")
    for i, pose in enumerate(poses[:6]):
        shutil.copy(folder / f"images/{i:03d}.png", folder / f"images/{100 + i:03d}.png")
        poses.append([100 + i, *pose[1:]])
    write_poses(folder / "poses.tum", poses)
    return []


def last_pose_twice(folder):
    path = folder / "poses.csv"
    path.write_text(path.read_text() + path.read_text().splitlines()[-1] + "\n")
    return []


def redrawn(change, views):
    def spoil(folder):
        for view in views:
            path = folder / f"images/{view:03d}.png"
            png.write(path, *change(*png.read(path)))
        return []
    return spoil


def pictures_that_are_none(folder):
    (folder / "images/004.png").write_bytes(b"")
    (folder / "images/005.png").write_text("no picture\n")
    (folder / "images/006.png").write_bytes((folder / "images/006.png").read_bytes()[:200])
    return []


def camera_info_changed(change):
    """change: of the numbers behind `data:` of the matrix (0) or the distortion (1)."""
    def spoil(folder):
        path = folder / "camera_info.yaml"
        lists = iter(range(9))
        def changed(match):
            values = [float(word) for word in match[2].split(",")]
            return match[1] + ", ".join(f"{value:.12g}" for value in change(next(lists), values)) + "]"
        path.write_text(re.sub(r"(data: *\[)([^\]]*)\]", changed, path.read_text()))
        return []
    return spoil


def longer_focal_length(which, values):
    return [1.05 * v if which == 0 and i in (0, 4) else v for i, v in enumerate(values)]


def other_distortion(which, values):
    return [-0.15, *values[1:]] if which == 1 else values


def cut_picture(folder):
    path = folder / "images/004.png"
    path.write_bytes(path.read_bytes()[:2000])
    return []


def without_intrinsics(folder):
    (folder / "camera_info.yaml").unlink()
    return []


def all_pictures_cut(folder):
    for path in (folder / "images").iterdir():
        path.write_bytes(path.read_bytes()[:500])
    return []


def without_target(folder):
    setup = json.loads((folder / "target.json").read_text())["setup"]
    (folder / "target.json").unlink()
    return ["--setup", setup]


def option(*words):
    return lambda folder: list(words)


def nothing(folder):
    return []


def both(first, second):
    return lambda folder: [*first(folder), *second(folder)]


class Trap:
    """`spoil` a copy of the set; the program must end with `code`. Refused: one line with all `words`. Handled: the
    right answer from `used` views, and warnings with all `words`."""

    def __init__(self, name, sound, spoil, code, *words, used=None):
        self.name, self.sound, self.spoil, self.code, self.words, self.used = name, sound, spoil, code, words, used


def traps():
    for setup, other in (("in", "eye-in-hand"), ("to", "eye-to-hand")):
        sound = f"{setup}_hand"
        yield Trap(f"{other}: nothing wrong", sound, nothing, 0, used=16)
        yield Trap(f"{other}: inverted poses", sound, poses_changed(lambda p: [inverted(x) for x in p]), 2, "inverted")
        yield Trap(f"{other}: swapped setup", sound, swapped_setup, 2, f"the setup is {other}")
        yield Trap(f"{other}: pairing off by one", sound, poses_changed(shifted), 2, "paired off by one")
        yield Trap(f"{other}: poses shuffled", sound, poses_changed(shuffled), 2, "do not tell of the same motion")
        yield Trap(f"{other}: order reversed", sound, poses_changed(backwards), 2, "the poses are in reverse order")
        yield Trap(f"{other}: quaternions w x y z", sound, poses_changed(w_first), 2, "quaternions are w x y z")
        yield Trap(f"{other}: target ten times too large", sound, option("--target", "chessboard:9x6:0.25"), 2,
                   "the target is 0.1")
        yield Trap(f"{other}: board transposed", sound, both(first_views(8), option("--target", "chessboard:6x9:0.025")), 0, used=8)
        yield Trap(f"{other}: outer corners", sound, both(first_views(6), option("--target", "chessboard:11x8:0.025")), 2,
                   "show one of 9x6 inner corners")
        yield Trap(f"{other}: angles as they should be", sound, as_angles("rx,ry,rz", 1), 0, used=16)
        yield Trap(f"{other}: degrees for radians", sound, as_angles("rx,ry,rz", math.degrees(1)), 2, "degrees?")
        yield Trap(f"{other}: radians for degrees", sound, as_angles("rx_deg,ry_deg,rz_deg", 1), 2,
                   "radians where degrees were expected")
        yield Trap(f"{other}: KUKA's angles", sound, as_angles("rx_deg,ry_deg,rz_deg", math.degrees(1), True), 2,
                   "--angles ZYX")
        yield Trap(f"{other}: KUKA's angles, said", sound,
                   both(as_angles("rx_deg,ry_deg,rz_deg", math.degrees(1), True), option("--angles", "ZYX")), 0, used=16)
        yield Trap(f"{other}: bare degrees and millimetres", sound, as_angles("", math.degrees(1), length=1000), 0,
                   "x y z [mm], three angles [deg]", used=16)
        yield Trap(f"{other}: a pose is missing", sound, poses_changed(lambda p: p[:5] + p[6:]), 0,
                   "005.png: no pose with number 5", "it is left out", used=15)
        yield Trap(f"{other}: millimetres", sound, poses_changed(millimetres), 2, "millimetres")
        yield Trap(f"{other}: squares 8 % too small", sound, option("--target", "chessboard:9x6:0.02315"), 3,
                   "the estimated size of the target is 1.0")
        yield Trap(f"{other}: squares 25 % too small", sound, option("--target", "chessboard:9x6:0.02"), 3,
                   "the estimated size of the target is 1.2")
        yield Trap(f"{other}: squares 2 % too large", sound, option("--target", "chessboard:9x6:0.0255"), 0,
                   "the estimated size of the target is 0.98", used=16)
        yield Trap(f"{other}: three views", sound, first_views(3), 2, "3 of 3 views", "at least 4")
        yield Trap(f"{other}: 30 % outliers", sound, poses_changed(some_jolted), 0, "5 of 16 views were not used",
                   used=11)
        yield Trap(f"{other}: copies", sound, copied, 0, "100.png: not used: a copy of 000.png",
                   "6 of 22 views were not used", used=16)
        yield Trap(f"{other}: a picture cut off", sound, cut_picture, 0, "004.png: not used", used=15)
        yield Trap(f"{other}: pictures that are none", sound, pictures_that_are_none, 0, "004.png", "005.png", "006.png",
                   used=13)
        yield Trap(f"{other}: quaternions that are not unit", sound, poses_changed(longer_quaternions), 2, "quaternion")
        yield Trap(f"{other}: two poses for one picture", sound, both(as_angles("rx,ry,rz", 1), last_pose_twice), 2,
                   "two poses")
        yield Trap(f"{other}: a pose that is no number", sound, poses_changed(with_no_number), 2, "poses.tum", "line 5")
        yield Trap(f"{other}: one pose 50 mm off", sound, poses_changed(one_moved), 0, "005.png: not used", used=15)
        yield Trap(f"{other}: identical poses", sound, poses_changed(at_one_place), 2, "the robot does not move in any row")
        yield Trap(f"{other}: Staubli's angles", sound, as_angles("rx,ry,rz", 1, angles=turning_xyz), 2, "--angles XYZ")
        yield Trap(f"{other}: Kawasaki's angles", sound,
                   as_angles("rx_deg,ry_deg,rz_deg", math.degrees(1), angles=turning_zyz), 2, "--angles ZYZ")
        yield Trap(f"{other}: rotation vectors for angles", sound, as_angles("rx,ry,rz", 1, angles=rotation_vector), 2,
                   "rotation vector")
        yield Trap(f"{other}: millimetres for the target", sound, option("--target", "chessboard:9x6:25"), 2, "millimetres")
        yield Trap(f"{other}: three pictures of half the size", sound, redrawn(png.halved, (2, 7, 11)), 0,
                   "320 x 240", "640 x 480", used=13)
        yield Trap(f"{other}: three pictures turned", sound, redrawn(png.turned, (2, 7, 11)), 0,
                   "turned by 180 deg", used=13)
        yield Trap(f"{other}: focal lengths 5 % off", sound, camera_info_changed(longer_focal_length), 0,
                   "the lens is not as stated", used=16)
        yield Trap(f"{other}: a distortion that the lens has not", sound, camera_info_changed(other_distortion), 0,
                   "the lens is not as stated", used=16)
    yield Trap("all pictures of half the size", "in_hand", redrawn(png.halved, range(16)), 2, "320 x 240", "640 x 480")
    yield Trap("two views", "in_hand", first_views(2), 2, "2 of 2 views", "at least 4")
    yield Trap("four views", "in_hand", first_views(4), 0, "4 views: noise levels and uncertainty are themselves uncertain",
               used=4)
    yield Trap("no intrinsics", "in_hand", without_intrinsics, 2, "flash-calib intrinsics")
    yield Trap("no target", "in_hand", without_target, 2, "names no target", "--target chessboard:9x6:0.025")
    yield Trap("half a target", "in_hand", option("--target", "chessboard:9x6"), 2, "chessboard:COLUMNSxROWS:SQUARE")
    yield Trap("a knock half-way", "in_hand", poses_changed(knocked_before(8)), 0, "the camera moved by", "before 008.png",
               ", ".join(f"{i:03d}.png" for i in range(8)) + ": not used: before the knock at 008.png", used=8)
    yield Trap("a knock after the first pictures", "in_hand", poses_changed(knocked_before(3)), 0, "the camera moved by",
               "before 003.png", used=13)
    yield Trap("a knock before the last pictures", "in_hand", poses_changed(knocked_before(13)), 3, "the camera moved by",
               "before 013.png", "where the camera is now is not known")
    yield Trap("squares 25 % too large, kept", "in_hand",
               both(option("--target", "chessboard:9x6:0.03125"), option("--target-size", "stated")), 0,
               "which was to be kept", used=16)
    yield Trap("a slow slip", "in_hand", poses_changed(drifting), 3, "the camera moved all the time, by", used=16)
    yield Trap("all pictures cut off", "in_hand", all_pictures_cut, 2, "none of 16 pictures", "000.png")
    yield Trap("a misspelt setup", "in_hand", option("--setup", "eye-in-hnad"), 2, "--setup", "eye-in-hand,eye-to-hand")
    yield Trap("another target", "in_hand", option("--target", "apriltag:36h11:0:0.05"), 2, "none of 16 pictures")
    yield Trap("one axis", "one_axis", nothing, 0, "is not told", "turns about that axis alone", used=8)
    yield Trap("one axis, a noisy robot", "one_axis_noisy", nothing, 0, "is not told", used=12)
    yield Trap("flipped boards", "flipped", nothing, 0, "numbered from its other end", used=8)


def draw(tool, work):
    common = ("640x480", "0.02", "0.2")
    program.must(tool, work / "in_hand", "eye-in-hand", BOARD, 16, *common, 1)
    program.must(tool, work / "to_hand", "eye-to-hand", BOARD, 16, *common, 2)
    program.must(tool, work / "late", "eye-in-hand", BOARD, 12, "640x480", "0.02", "0.2", 7, "motion=stream", "time_offset=0.03")
    program.must(tool, work / "one_axis", "eye-in-hand", BOARD, 8, *common, 3, "motion=one-axis")
    program.must(tool, work / "one_axis_noisy", "eye-in-hand", BOARD, 12, "640x480", "0.3", "0.5", 5, "motion=one-axis")
    program.must(tool, work / "flipped", "eye-in-hand", PLAIN, 8, *common, 4)


def far_off(result, truth):
    """The largest error in its stated standard deviations, over translation and over rotation, of what is told."""
    t, q = result["transform"]["translation"], result["transform"]["rotation_xyzw"]
    sd = result["predicted_sd"]
    away = [b - a for a, b in zip(t, truth[1:4])]
    turn = [2 * x for x in multiply(conjugate(q), truth[4:])]
    turn = turn[:3] if turn[3] > 0 else [-x for x in turn[:3]]
    return max([abs(1000 * a) / s for a, s in zip(away, sd["translation_parent_mm"]) if s is not None] +
               [abs(math.degrees(a)) / s for a, s in zip(turn, sd["rotation_deg"])])


def complaint(trap, calib, work):
    """What is wrong with how the program took it; empty where nothing is."""
    folder, out = work / "spoilt", work / "camera.json"
    for path in (folder, out, out.with_suffix(".html")):
        shutil.rmtree(path, ignore_errors=True) if path.is_dir() else path.unlink(missing_ok=True)
    shutil.copytree(work / trap.sound, folder)
    options = trap.spoil(folder)
    done = program.call(calib, "handeye", folder, *options, "--cache", work / "cache", "-o", out)
    if done.returncode != trap.code:
        return f"exit code {done.returncode}, expected {trap.code}: {done.stderr[-2000:]}"
    missing = [word for word in trap.words if word not in done.stderr]
    if missing:
        return f"does not say {missing}: {done.stderr[-2000:]}"
    if trap.code == 2:
        refusals = [line for line in done.stderr.splitlines() if not line.startswith("flash-calib: warning:")]
        if len(refusals) != 1:
            return f"not one sentence: {refusals}"
        return "left a file behind" if out.exists() else ""
    result = json.loads(out.read_text())
    if result["exit_code"] != trap.code:
        return f"the file says exit code {result['exit_code']}"
    last = done.stderr.splitlines()[-1] if done.stderr else ""
    refusal = last.removeprefix("flash-calib: the answer cannot be used (exit code 3): ")
    if (refusal != last) != (trap.code == 3):
        return f"the last line should {'' if trap.code == 3 else 'not '}say that the answer cannot be used: {last}"
    if trap.code == 3:
        told = f"{refusal}; the answer cannot be used" in result["warnings"]
        return "" if told else f"not a warning: {refusal}"
    used = sum(view["used"] for view in result["views"])
    if used != trap.used:
        return f"used {used} views, expected {trap.used}: {[v['reason'] for v in result['views'] if not v['used']]}"
    off = far_off(result, read_poses(folder / "truth/X_and_Z.tum")[0])
    return f"off by {off:.1f} standard deviations" if off > SIGMAS else ""


def solved_before_a_terminal(calib, work):
    """What a terminal sees of a calibration: stdout, and stderr with all its returns."""
    terminal, ours = pty.openpty()
    with subprocess.Popen([calib, "handeye", work / "in_hand", "--force", "-o", work / "camera.json"], text=True,
                          stdout=subprocess.PIPE, stderr=ours) as running:
        os.close(ours)
        seen = []
        reader = threading.Thread(target=lambda: seen.extend(iter(lambda: read_terminal(terminal), b"")))
        reader.start()
        stdout = running.stdout.read()
        reader.join()
    os.close(terminal)
    return stdout, b"".join(seen).decode()


def read_terminal(terminal):
    try:
        return os.read(terminal, 4096)
    except OSError:  # its other end is closed
        return b""


def wrongly_told(calib, work):
    """What is wrong with what a calibration tells on its way and at its end."""
    stdout, terminal = solved_before_a_terminal(calib, work)
    for line in ("looking for the target", "16 of 16 pictures", "solving"):
        if f"\r{line}\033[K" not in terminal:
            yield f"a terminal is not told {line!r}: {terminal!r}"
    if not terminal.endswith("\r\033[K"):
        yield f"the line of progress is left behind: {terminal!r}"
    focal = re.search(r"lens: fx ([\d.]+) \+- ([\d.]+), fy ([\d.]+) \+- ([\d.]+), cx ", stdout)
    if not focal:
        yield f"no focal lengths: {stdout}"
    for length, sd in zip(focal.groups()[::2], focal.groups()[1::2]) if focal else ():
        if len(length.partition(".")[2]) != len(sd.partition(".")[2]):
            yield f"a focal length and its deviation end at different digits: {length} +- {sd}"
        if len(sd.replace(".", "").lstrip("0")) < 2:
            yield f"a deviation of a focal length of less than two digits: {sd}"
    piped = program.call(calib, "handeye", work / "in_hand", "--force", "-o", work / "camera.json")
    if "\r" in piped.stderr or "solving" in piped.stderr:
        yield f"progress where there is no terminal: {piped.stderr!r}"
    late = program.call(calib, "handeye", work / "late", "-o", work / "late.json")
    valid = program.call(calib, "validate", work / "late", "--extrinsics", work / "late.json")
    if late.returncode or valid.returncode or "as the calibration found" not in valid.stderr:
        yield f"pictures that are 30 ms late do not agree with what was found from them: {late.stderr} {valid.stderr}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--calib", required=True, help="the program flash-calib")
    parser.add_argument("--draw", required=True, help="the program rendered_dataset")
    parser.add_argument("--only", default="", help="traps whose name has this")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        work = pathlib.Path(temporary)
        draw(options.draw, work)
        chosen = [trap for trap in traps() if options.only in trap.name]
        failed = 0
        for wrong in () if options.only else wrongly_told(options.calib, work):
            failed += 1
            print(wrong, flush=True)
        failed_to_tell = failed
        for trap in chosen:
            wrong = complaint(trap, options.calib, work)
            failed += bool(wrong)
            if wrong:
                print(f"{trap.name}: {wrong}", flush=True)
        print(f"{len(chosen) - failed + failed_to_tell} of {len(chosen)} traps handled, or refused in one sentence that names the cause")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
