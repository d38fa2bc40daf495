#!/usr/bin/env python3
"""What people have reported in public of their hand-eye calibrations, each as a small set of its kind: the right answer, or
the sentence that would have told them. Named after where it was reported."""
import argparse
import json
import math
import pathlib
import random
import shutil
import struct
import sys
import tempfile
import zipfile

import program
from calib_traps import read_poses

ANSWERED, REFUSED, UNUSABLE = 0, 2, 3
BOARD = "chessboard:9x6:0.025"
PENDANT = (243.69, -249.04, 618.32, 149.49, -12.78, 72.64)  # x y z [mm], roll pitch yaw [deg] of UR ROS2 driver#791


# Poses as 4 x 4 matrices, lists of rows.

def multiply(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]


def inverse(T):
    R = [[T[j][i] for j in range(3)] for i in range(3)]
    return [[*R[i], -sum(R[i][k] * T[k][3] for k in range(3))] for i in range(3)] + [[0, 0, 0, 1]]


def turn_about(vector):
    """Rows of the rotation about a vector by its length."""
    angle = math.sqrt(sum(x * x for x in vector))
    x, y, z = (c / angle for c in vector) if angle > 1e-12 else (1, 0, 0)
    c, s, d = math.cos(angle), math.sin(angle), 1 - math.cos(angle)
    return [[c + x * x * d, x * y * d - z * s, x * z * d + y * s], [y * x * d + z * s, c + y * y * d, y * z * d - x * s],
            [z * x * d - y * s, z * y * d + x * s, c + z * z * d]]


def pose(place, vector):
    return [[*row, t] for row, t in zip(turn_about(vector), place)] + [[0, 0, 0, 1]]


def of_quaternion(line):
    """Of a line of a TUM file."""
    x, y, z, w = line[4:]
    s = math.sqrt(x * x + y * y + z * z)
    angle = 2 * math.atan2(s, w)
    return pose(line[1:4], [angle * c / s for c in (x, y, z)] if s > 1e-12 else [0, 0, 0])


def quaternion(T):
    """x y z w, by the largest of its squares."""
    squares = [1 + T[0][0] - T[1][1] - T[2][2], 1 - T[0][0] + T[1][1] - T[2][2], 1 - T[0][0] - T[1][1] + T[2][2],
               1 + T[0][0] + T[1][1] + T[2][2]]
    i = max(range(4), key=squares.__getitem__)
    off = [T[2][1] - T[1][2], T[0][2] - T[2][0], T[1][0] - T[0][1]]
    q = [T[0][1] + T[1][0], T[0][2] + T[2][0], T[1][2] + T[2][1]]
    rows = ([squares[0], q[0], q[1], off[0]], [q[0], squares[1], q[2], off[1]], [q[1], q[2], squares[2], off[2]],
            [*off, squares[3]])
    return [c / (2 * math.sqrt(squares[i])) for c in rows[i]]


def roll_pitch_yaw(T):
    return (math.atan2(T[2][1], T[2][2]), math.asin(max(-1, min(1, -T[2][0]))), math.atan2(T[1][0], T[0][0]))


def from_roll_pitch_yaw(place, angles):
    """About fixed x, y, z [deg]."""
    T = pose(place, [0, 0, 0])
    for axis in (2, 1, 0):
        T = multiply(T, pose([0, 0, 0], [math.radians(angles[axis]) if k == axis else 0 for k in range(3)]))
    return T


def angle_between(a, b):
    R = multiply(inverse(a), b)
    return math.degrees(math.acos(max(-1, min(1, (R[0][0] + R[1][1] + R[2][2] - 1) / 2))))


class Cell:
    """An eye in the hand that looks at a target: pairs of poses, true or as noisy as told (one standard deviation an axis)."""

    def __init__(self, views=16, seed=1, robot_mm=0.2, robot_deg=0.02, tilt=0.6, spread=0.12):
        rng = random.Random(seed)
        self.camera, self.target = pose([0.05, 0.02, 0.08], [0.1, -0.2, 0.4]), pose([0.6, 0.1, 0.02], [0.1, 3.0, 0.2])
        self.seen, self.robot = [], []
        for _ in range(views):
            seen = pose([rng.uniform(-spread, spread), rng.uniform(-spread, spread), 0.5 + rng.uniform(-spread, spread)],
                        [rng.uniform(-tilt, tilt) for _ in range(3)])
            true = multiply(multiply(self.target, inverse(seen)), inverse(self.camera))
            error = pose([rng.gauss(0, robot_mm / 1000) for _ in range(3)],
                         [rng.gauss(0, math.radians(robot_deg)) for _ in range(3)])
            self.seen.append(seen)
            self.robot.append(multiply(true, error))

    def write(self, path):
        path.write_text(json.dumps([{"robot": g, "target": c} for g, c in zip(self.robot, self.seen)]))
        return path


class FourAxisCell(Cell):
    """The same by an arm that turns about the vertical alone."""

    def __init__(self, views=20, seed=1, robot_mm=0.2, robot_deg=0.02):
        rng = random.Random(seed)
        self.camera, self.target = pose([0.05, 0.02, 0.08], [0.1, -0.2, 0.4]), pose([0.6, 0.1, 0.02], [0.1, 3.0, 0.2])
        self.seen, self.robot = [], []
        for _ in range(views):
            down = multiply(pose([0, 0, 0], [0, 0, rng.uniform(-1.2, 1.2)]), pose([0, 0, 0], [math.pi, 0, 0]))
            # Where the target is seen, from which the gripper's place follows.
            middle = multiply(self.camera, pose([rng.uniform(-.08, .08), rng.uniform(-.08, .08), rng.uniform(.4, .6)], [0, 0, 0]))
            held = multiply(down, middle)
            robot = [[*row[:3], self.target[i][3] - held[i][3]] for i, row in enumerate(down[:3])] + [[0, 0, 0, 1]]
            error = pose([rng.gauss(0, robot_mm / 1000) for _ in range(3)],
                         [rng.gauss(0, math.radians(robot_deg)) for _ in range(3)])
            self.robot.append(robot)
            self.seen.append(multiply(multiply(inverse(self.camera), inverse(multiply(robot, error))), self.target))


def longer(T, factor):
    return [[*row[:3], row[3] * factor] for row in T[:3]] + [T[3]]


def save_npz(path, compression=zipfile.ZIP_STORED, **stacks):
    """As numpy.savez and numpy.savez_compressed write stacks of matrices."""
    with zipfile.ZipFile(path, "w", compression) as archive:
        for name, stack in stacks.items():
            head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({len(stack)}, 4, 4), }}".encode()
            head += b" " * (-(len(head) + 11) % 64) + b"\n"
            values = [value for T in stack for row in T for value in row]
            archive.writestr(f"{name}.npy", b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head +
                             struct.pack(f"<{len(values)}d", *values))
    return path


class Report:
    """`make` writes the input below a folder and returns the words of the command line; the program must end with `code` and
    say all `words`, and none of `unsaid`. `holds`: of the answer's JSON, what is wrong with it."""

    def __init__(self, name, make, code, *words, unsaid=(), holds=lambda answer: ""):
        self.name, self.make, self.code, self.words, self.unsaid, self.holds = name, make, code, words, unsaid, holds


def pairs(change=lambda cell: None, **settings):
    """handeye on pairs of poses."""
    def make(folder, sets):
        cell = Cell(**settings)
        change(cell)
        return ["handeye", cell.write(folder / "pairs.json"), "--setup", "eye-in-hand"]
    return make


def pairs_with(*options):
    def make(folder, sets):
        return [*pairs()(folder, sets), *options]
    return make


def pictures(change, *options, name="in_hand"):
    """handeye on a copy of drawn pictures."""
    def make(folder, sets):
        shutil.copytree(sets / name, folder / "set")
        more = change(folder / "set") or []
        return ["handeye", folder / "set", *options, *more]
    return make


def four_axis_pairs(*options):
    def make(folder, sets):
        return ["handeye", FourAxisCell().write(folder / "pairs.json"), "--setup", "eye-in-hand", *options]
    return make


def all_but_height(answer):
    """x, y and yaw with deviations, z not told."""
    x, y, z = answer["predicted_sd"]["translation_parent_mm"]
    place, yaw = answer["transform"]["translation"], answer["predicted_sd"]["rotation_parent_deg"][2]
    if z is not None or answer["one_axis"]["told"] or not (x < 1 and y < 1 and yaw < 0.2):
        return f"deviations of {x}, {y}, {z} mm and {yaw} deg"
    off = [abs(place[0] - 0.05) * 1000 / x, abs(place[1] - 0.02) * 1000 / y]
    return "" if max(off) < 4 else f"is off by {off} deviations"


def whole_by_height(answer):
    sd, place = answer["predicted_sd"]["translation_parent_mm"], answer["transform"]["translation"]
    if not answer["one_axis"]["told"] or not 0.9 < sd[2] < 1.5:
        return f"deviations of {sd} mm by a height to 1 mm"
    return "" if abs(place[2] - 0.08) < 4e-3 else f"the camera is at {place[2]} m, expected 0.08"


def stands_still(cell):
    cell.robot = [cell.robot[0]] * len(cell.robot)


def smaller_by_camera(cell):
    """Norms of relative motions are .185 m by the arm and .128 m by the camera."""
    cell.seen = [longer(T, 0.128 / 0.185) for T in cell.seen]


def inverted(cell):
    cell.robot = [inverse(T) for T in cell.robot]


def matrix_that_is_none(cell):
    cell.seen[3] = [[0.988995, *cell.seen[3][0][1:]], *cell.seen[3][1:]]


def rows_of(folder, row):
    """Robot poses in place of poses.tum, a line each, as `row` writes a matrix."""
    poses = [of_quaternion(line) for line in read_poses(folder / "poses.tum")]
    (folder / "poses.tum").unlink()
    (folder / "poses.csv").write_text("".join(row(T) + "\n" for T in poses))


def numbers(values):
    return ",".join(f"{value:.10g}" for value in values)


def pendant(folder):
    """The pendant's six numbers, in a base in which the first pose is that of the report."""
    poses = [of_quaternion(line) for line in read_poses(folder / "poses.tum")]
    first = from_roll_pitch_yaw([x / 1000 for x in PENDANT[:3]], PENDANT[3:])
    base = multiply(first, inverse(poses[0]))
    (folder / "poses.tum").unlink()
    (folder / "poses.csv").write_text("".join(
        numbers([*(1000 * row[3] for row in T[:3]), *(math.degrees(a) for a in roll_pitch_yaw(T))]) + "\n"
        for T in (multiply(base, T) for T in poses)))


def first_is_the_reports(answer):
    """tool0 in the base, of which the driver has the flange: they differ by a fixed turn of quarters, and by .22 deg."""
    x, y, z, qx, qy, qz, qw = answer["views"][0]["base_gripper"]
    tool = of_quaternion([0, x, y, z, qx, qy, qz, qw])
    flange = of_quaternion([0, 0, 0, 0, 0.170, 0.472, -0.074, 0.862])
    between = multiply(inverse(flange), tool)
    off = max(min(abs(value), abs(abs(value) - 1)) for row in between[:3] for value in row[:3])
    return "" if off < math.radians(0.5) else f"tool0 is off the driver's flange by more than quarters: {between}"


def kuka(folder):
    poses = [of_quaternion(line) for line in read_poses(folder / "poses.tum")]
    (folder / "poses.tum").unlink()
    (folder / "poses.csv").write_text("X,Y,Z,A,B,C\n" + "".join(
        numbers([*(row[3] for row in T[:3]), *(math.degrees(a) for a in reversed(roll_pitch_yaw(T)))]) + "\n" for T in poses))


def side_by_side(invert):
    def change(folder):
        poses = [of_quaternion(line) for line in read_poses(folder / "poses.tum")]
        poses = [inverse(T) for T in poses] if invert else poses
        (folder / "poses.tum").unlink()
        (folder / "RobotToolPose.csv").write_text("".join(
            numbers([value for T in poses for value in T[i]]) + "\n" for i in range(4)))
        return ["--poses", folder / "RobotToolPose.csv"]
    return change


def as_npz(folder):
    poses = [of_quaternion(line) for line in read_poses(folder / "poses.tum")]
    (folder / "poses.tum").unlink()
    save_npz(folder / "poses.npz", T_base_ee=poses)


def four_that_do_not_belong(folder, sets):
    """Turns by 137 and 27, 77 and 170 deg by robot and by camera."""
    cell = Cell(views=4, tilt=1.5, seed=3)
    first = cell.robot[0]
    for k, (robot, camera) in enumerate(((137, 27), (77, 170), (60, 110)), 1):
        axis = [0.6, -0.64, 0.48] if k == 1 else [0.36, 0.48, 0.8] if k == 2 else [0.8, 0.6, 0]
        cell.robot[k] = multiply(first, pose([0.1 * k, -0.05, 0.02 * k], [math.radians(robot) * a for a in axis]))
        cell.seen[k] = multiply(pose([0.02 * k, 0.03, 0.01 * k], [math.radians(camera) * a for a in reversed(axis)]), cell.seen[0])
    return ["handeye", save_npz(folder / "samples.npz", T_base_ee=cell.robot, T_cam_board=cell.seen), "--setup", "eye-in-hand"]


def npz_pairs(folder, sets):
    cell = Cell()
    return ["handeye", save_npz(folder / "pairs.npz", T_base_ee=cell.robot, T_cam_board=cell.seen), "--setup", "eye-in-hand"]


def compressed_npz_pairs(folder, sets):
    cell = Cell()
    return ["handeye", save_npz(folder / "pairs.npz", zipfile.ZIP_DEFLATED, T_base_ee=cell.robot, T_cam_board=cell.seen), "--setup", "eye-in-hand"]


def damaged_npz_pairs(folder, sets):
    words = npz_pairs(folder, sets)
    file = bytearray((folder / "pairs.npz").read_bytes())
    file[len(file) // 2] ^= 1
    (folder / "pairs.npz").write_bytes(file)
    return words


def two_clocks(folder):
    """Pictures by the simulator's time, poses by the wall clock's."""
    for k, path in enumerate(sorted((folder / "images").iterdir())):
        path.rename(path.with_name(f"{685 + 0.5 * k:.3f}.png"))
    lines = [f"{1715408108.25 + 0.5 * k} " + " ".join(map(str, pose[1:])) for k, pose in enumerate(read_poses(folder / "poses.tum"))]
    (folder / "poses.tum").write_text("\n".join(lines) + "\n")


def with_results(folder):
    """What a program drew of its pictures lies beside them."""
    for path in sorted((folder / "images").iterdir()):
        shutil.copy(path, path.with_name(f"CalibratedResult{path.name}"))


def with_results_in_order(folder):
    with_results(folder)
    rows_of(folder, lambda T: numbers([value for row in T[:3] for value in row]))


def one_picture_less(folder):
    rows_of(folder, lambda T: numbers([value for row in T[:3] for value in row]))
    sorted((folder / "images").iterdir())[-1].unlink()


def other_names(folder, **more):
    """Intrinsics as {Intrinsic, Distortion}."""
    (folder / "camera_info.yaml").unlink(missing_ok=True)
    (folder / "intrinsics.json").write_text(json.dumps(
        {"Intrinsic": [[615, 0, 319.5], [0, 615, 239.5], [0, 0, 1]], "width": 640, "height": 480} | more))


def quaternions_w_first(folder):
    rows_of(folder, lambda T: numbers([*(row[3] for row in T[:3]), *(quaternion(T)[k] for k in (3, 0, 1, 2))]))


def quaternions_w_last(folder):
    rows_of(folder, lambda T: numbers([*(row[3] for row in T[:3]), *quaternion(T)]))


def wide(answer):
    """A camera that eight nearly equal poses put somewhere."""
    sd = answer["predicted_sd"]["translation_mm"]
    return "" if max(sd) > 5 else f"deviations of {sd} mm of nearly equal poses"


def robot_noise(answer):
    """10 to 15 mm and 1 to 2 deg are 7 mm an axis, and 1.5 deg."""
    sigmas, sd = answer["sigmas"], answer["predicted_sd"]["translation_mm"]
    if not 0.004 < sigmas["robot_translation_m"] < 0.010:
        return f"robot noise of {1000 * sigmas['robot_translation_m']:.1f} mm, expected about 7"
    return "" if max(sd) > 1.5 else f"deviations of {sd} mm"


def known_size(answer):
    scale = answer["scale"]
    return "" if abs(scale["estimate"] - 1) < 0.01 else f"a right board is taken to be {scale['estimate']} times as large"


def reports():
    yield Report("robot_system_tools#33", pairs(stands_still), REFUSED, "the robot does not move in any row")
    yield Report("handeye_calib_camodocal#12", pairs(smaller_by_camera), UNUSABLE, "1.44", "times as large as stated",
                 "not in metres")
    yield Report("UR ROS2 driver#791", pictures(pendant), ANSWERED, "x y z [mm], three angles [deg]", holds=first_is_the_reports)
    yield Report("zivid-python#336", pairs(inverted), REFUSED, "inverted")
    yield Report("visp#729", pairs(views=8, tilt=0.02, spread=0.01, robot_mm=0.5, robot_deg=0.1), REFUSED, "turns by no more than")
    yield Report("visp#729, larger turns", pairs(views=8, tilt=0.06, spread=0.01, robot_mm=0.5, robot_deg=0.1), None, holds=wide)
    yield Report("lerobot#3345", pictures(lambda folder: None, name="loose"), ANSWERED, holds=robot_noise)
    yield Report("RealMan#12", pictures(side_by_side(True)), REFUSED, "matrices side by side", "inverted")
    yield Report("RealMan#12, not inverted", pictures(side_by_side(False)), ANSWERED, "matrices side by side")
    yield Report("easy_handeye#140", pictures(two_clocks), REFUSED, "685", "1715408108", "simulated time", "wall clock")
    yield Report("npz of pairs", npz_pairs, ANSWERED)
    yield Report("npz of pairs, compressed", compressed_npz_pairs, ANSWERED)
    yield Report("npz of pairs, damaged", damaged_npz_pairs, REFUSED, "is damaged")
    yield Report("pairs and pixels", pairs_with("--for", "image"), REFUSED, "--for", "have no pixels")
    yield Report("npz of poses beside pictures", pictures(as_npz), ANSWERED, "in the order of the pictures")
    yield Report("npz of four samples", four_that_do_not_belong, REFUSED, "robot and camera do not tell of the same motion",
                 "the robot turns by 137", "27.0 deg", unsaid=("--angles", "inverted", "w x y z", "paired off"))
    yield Report("OrbbecSDK_ROS2#55", pictures(lambda folder: None, name="near_depth"), REFUSED,
                 "depth puts the target at 0.25")
    yield Report("K4A-Wrapper#109", pairs(matrix_that_is_none), REFUSED, "pair 3", "no rotation", "0.989", "expected 1")
    yield Report("intrinsics by other names", pictures(lambda folder: other_names(folder, Distortion=[0, 0, 0, 0, 0])), ANSWERED)
    yield Report("a fisheye's coefficients",
                 pictures(lambda folder: other_names(folder, Distortion=[0.1, 0.01, 0, 0], distortion_model="equidistant")),
                 REFUSED, "intrinsics.json", "equidistant", "plumb_bob")
    yield Report("pictures of a program's output", pictures(with_results), REFUSED, "16 CalibratedResultN", "16 N",
                 "with the same numbers")
    yield Report("pictures of a program's output, in order", pictures(with_results_in_order), REFUSED, "16 poses", "32 pictures",
                 "16 CalibratedResultN")
    yield Report("a board of 25 mm that is 29.85", pictures(lambda folder: None, "--target", "chessboard:9x6:0.02094"), UNUSABLE,
                 "the estimated size of the target is 1.19")
    yield Report("a right board on a loose arm", pictures(lambda folder: None, name="loose"), ANSWERED, holds=known_size)
    yield Report("24 poses, 23 pictures", pictures(one_picture_less), REFUSED, "16 poses", "15 pictures")
    yield Report("KUKA's A, B, C", pictures(kuka), ANSWERED)
    yield Report("quaternions without a header, w last", pictures(quaternions_w_last), ANSWERED, "quaternion x y z w")
    yield Report("quaternions without a header, w first", pictures(quaternions_w_first), REFUSED, "quaternions are w x y z")


    yield Report("SCARA", four_axis_pairs(), ANSWERED, "is not told", "--target-height", holds=all_but_height)
    yield Report("SCARA, the target's height measured", four_axis_pairs("--target-height", "0.02:0.001"), ANSWERED,
                 unsaid=("not told",), holds=whole_by_height)
    yield Report("SCARA, as URDF", four_axis_pairs("--urdf", "joint.urdf"), REFUSED, "--urdf", "is not told")
    yield Report("two axes and a height", pairs_with("--camera-height", "0.08"), REFUSED, "--camera-height", "leave it out")


def draw(tool, sets):
    common = ("eye-in-hand", BOARD, 16, "640x480")
    program.must(tool, sets / "in_hand", *common, "0.02", "0.2", 1)
    program.must(tool, sets / "loose", *common, "1.5", "7", 3)
    program.must(tool, sets / "near_depth", *common, "0.02", "0.2", 1, "depth_mm=1", "depth_factor=0.25")


def judged(report, options, sets):
    """Statements of one report."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        out = folder / "camera.json"
        done = program.call(options.calib, *report.make(folder, sets), "--cache", sets / "cache", "-o", out)
        said = f"{report.name}: exit code {done.returncode}: {done.stderr[-1500:]}"
        yield done.returncode == report.code if report.code is not None else done.returncode in (ANSWERED, UNUSABLE), said
        yield all(word in done.stderr for word in report.words), f"does not say {report.words}: {said}"
        yield not any(word in done.stderr for word in report.unsaid), f"says one of {report.unsaid}: {said}"
        if done.returncode == REFUSED:
            lines = [line for line in done.stderr.splitlines() if not line.startswith("flash-calib: warning:")]
            yield len(lines) == 1 and not out.exists(), f"not one line, or a file is left: {said}"
        elif out.exists():
            wrong = report.holds(json.loads(out.read_text()))
            yield not wrong, f"{report.name}: {wrong}"


def a_minute_apart(options, sets):
    """droid-dataset#42: two recordings of a camera that stands still are said to be the same, and of one that moved not."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        for name, seed in (("camera", 5), ("later", 6), ("moved", 7)):
            cell = Cell(seed=seed)
            if name == "moved":
                away = pose([0.008, 0, 0], [0, 0.01, 0])
                cell.seen = [multiply(inverse(away), T) for T in cell.seen]
            program.must(options.calib, "handeye", cell.write(folder / f"{name}_pairs.json"), "--setup", "eye-in-hand", "-o",
                         folder / f"{name}.json")
        same = program.call(options.calib, "validate", folder / "later.json", "--extrinsics", folder / "camera.json")
        yield same.returncode == ANSWERED and same.stdout.startswith("same: ") and "with a chance of" in same.stdout, \
            f"droid-dataset#42: {same.returncode}: {same.stdout}{same.stderr}"
        moved = program.call(options.calib, "validate", folder / "moved.json", "--extrinsics", folder / "camera.json", "--json")
        fields = json.loads(moved.stdout) if moved.returncode == UNUSABLE else {}
        yield fields.get("moved") is True and fields["chance"] < 1e-3 and 6 < fields["apart_mm"] < 10, \
            f"droid-dataset#42, moved: {moved.returncode}: {moved.stdout}{moved.stderr}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--calib", required=True, help="the program flash-calib")
    parser.add_argument("--draw", required=True, help="the program rendered_dataset")
    parser.add_argument("--only", default="", help="reports whose name has this")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        sets = pathlib.Path(temporary)
        draw(options.draw, sets)
        results = [statement for report in reports() if options.only in report.name
                   for statement in judged(report, options, sets)]
        if not options.only:
            results += a_minute_apart(options, sets)
        sys.exit(program.conclude(results))


if __name__ == "__main__":
    main()
