#!/usr/bin/env python3
"""How often flash-calib's 95 % region of pairs of poses holds the truth: arms of three makes whose zeros, links, axes and gears are off, seen by a
camera that scatters. Arms, poses and pairs are drawn by this file and arm_errors.py alone. Prints a table: pairs far apart and near each
other, few, in clusters, of an arm that has noise alone, and with poses of the target that a lens of another focal length made, or of a target of
another size. Base and gripper are those that the robot
reports: what its first and its last joint are off by at every pose alike is part of them, as it is where the robot works."""
import argparse
import json
import math
import pathlib
import subprocess
import tempfile

import numpy

from arm_errors import ARMS, ERRORS, gripper, turned

CHI_SQUARE_95 = 12.592  # six degrees of freedom
# Of the camera: turns [rad], across its line of sight and along it [m]. Of the robot: what it does not repeat [rad, m].
CAMERA, REPEATABILITY, NOISE = (math.radians(0.1), 2e-4, 8e-4), (5e-5, 2e-5), (math.radians(0.05), 5e-4)
# Of a camera whose poses are made here: focal length, noise of corners [px]; corners of the board [m].
FOCAL, CORNER = 900, 0.2
BOARD = numpy.array([(0.025 * (i - 4), 0.025 * (j - 2.5), 0) for j in range(6) for i in range(9)])
# Pairs, how far joints move either way [rad], clusters of 0.06 rad (0: none), and whether the arm's model is off.
KINDS = {"14 pairs": (14, 0.6, 0, True), "30 pairs": (30, 0.6, 0, True), "4 pairs": (4, 0.6, 0, True), "6 pairs": (6, 0.6, 0, True),
         "near each other": (14, 0.2, 0, True), "three clusters": (14, 0.4, 3, True), "noise alone": (14, 0.6, 0, False)}
# Likewise, and by how much the focal length is off with which target poses are made: a standard deviation, or that much either way.
LENSES = {"lens 0.5 % (sd)": ("14 pairs", lambda random: 0.005 * random.standard_normal()), "lens 1 %": ("14 pairs", lambda random: 0.01 * random.choice((-1, 1))),
          "lens 2 %": ("14 pairs", lambda random: 0.02 * random.choice((-1, 1))), "lens 2 %, 30 pairs": ("30 pairs", lambda random: 0.02 * random.choice((-1, 1))),
          "lens 2 %, noise alone": ("noise alone", lambda random: 0.02 * random.choice((-1, 1)))}
# Likewise, and how many times as large as stated the target is, or its inverse.
SIZES = {"4 pairs, size 10 %": ("4 pairs", 1.1), "6 pairs, size 10 %": ("6 pairs", 1.1), "14 pairs, size 10 %": ("14 pairs", 1.1),
         "14 pairs, size 3 %": ("14 pairs", 1.03)}


def pose(R, t):
    T = numpy.eye(4)
    T[:3, :3], T[:3, 3] = R, t
    return T


def scattered(random, turn, shift):
    return pose(turned(turn * random.standard_normal(3)), shift * random.standard_normal(3))


def pose_from_corners(random, T, off):
    """The pose that fits the corners best, by Gauss and Newton from the true one, with a focal length that is off by this share."""
    def seen(T, focal):
        places = BOARD @ T[:3, :3].T + T[:3, 3]
        return places, focal * places[:, :2] / places[:, 2:]

    corners = seen(T, FOCAL)[1] + CORNER * random.standard_normal((len(BOARD), 2))
    focal = FOCAL * (1 + off)
    for _ in range(12):
        (x, y, z), pixels = seen(T, focal)[0].T, seen(T, focal)[1]
        zero = numpy.zeros_like(x)
        by_place = focal * numpy.stack([numpy.stack([1 / z, zero, -x / z ** 2], -1), numpy.stack([zero, 1 / z, -y / z ** 2], -1)], 1)
        arms = BOARD @ T[:3, :3].T
        by_turn = numpy.stack([numpy.cross(axis, arms) for axis in numpy.eye(3)], -1)
        jacobian = numpy.concatenate([by_place @ by_turn, by_place], -1).reshape(-1, 6)
        step = numpy.linalg.lstsq(jacobian, (corners - pixels).reshape(-1), rcond=None)[0]
        T = pose(turned(step[:3]) @ T[:3, :3], T[:3, 3] + step[3:])
    return T


def constant_errors(joints, tool, zeros, origins, axes):
    """What is wrong with the first and with the last joint alike at every pose: T_true = L T R of an arm without these errors."""
    (first, _), (_, last) = joints[0], joints[-1]  # the first turns about its own z, on which it stands
    L = pose(turned(axes[0]) @ turned((0, 0, zeros[0])), numpy.array(first) + origins[0]) @ pose(numpy.eye(3), -numpy.array(first))
    R = pose(numpy.eye(3), -numpy.array(tool)) @ pose(turned(zeros[-1] * numpy.array(last, float)), (0, 0, 0)) @ pose(numpy.eye(3), numpy.array(tool) + origins[-1])
    return L, R


def drawn(random, setup, kind):
    """Poses of the gripper and of the target, as they are reported, X, and X from the base or to the gripper that the robot reports."""
    kind, size = SIZES.get(kind, (kind, None))
    kind, off = LENSES.get(kind, (kind, None))
    off = None if off is None else off(random)
    count, spread, clusters, wrong = KINDS[kind]
    joints, tool, home = ARMS[list(ARMS)[random.integers(len(ARMS))]]
    n = len(joints)
    zero, length, axis, gear = ERRORS[random.integers(len(ERRORS))] if wrong else (0, 0, 0, 0)
    zeros, harmonics = numpy.radians(random.normal(0, zero, n)), numpy.radians(random.normal(0, gear, n))
    phases, origins, axes = random.uniform(0, 2 * math.pi, n), random.normal(0, 1e-3 * length, (n + 1, 3)), numpy.radians(random.normal(0, axis, (n, 3)))
    right = numpy.zeros((n + 1, 3)), numpy.zeros((n, 3))
    middle = numpy.array(home) + random.uniform(-0.4, 0.4, n)
    centres = middle + random.uniform(-spread, spread, (max(clusters, 1), n)) if clusters else [middle]
    at = pose(*gripper(joints, tool, middle, *right))
    # What is mounted on the gripper, and what stands before it.
    held = pose(turned(0.3 * random.standard_normal(3)), 0.06 * random.standard_normal(3))
    before = pose(turned((0, 0, random.uniform(-3, 3))) @ turned(0.2 * random.standard_normal(3)),
                  (0, 0, random.uniform(0.35, 0.7) if setup == "eye-in-hand" else random.uniform(0.6, 1.3)))
    in_hand = setup == "eye-in-hand"
    X = held if in_hand else at @ held @ numpy.linalg.inv(before)
    Z = at @ held @ before if in_hand else held
    robot, target = [], []
    while len(robot) < count:
        q = centres[random.integers(len(centres))] + (0.06 * random.standard_normal(n) if clusters else random.uniform(-spread, spread, n))
        told = pose(*gripper(joints, tool, q, *right))
        true = pose(*gripper(joints, tool, q + zeros + harmonics * numpy.sin(q + phases), origins, axes)) @ scattered(random, *REPEATABILITY)
        seen = numpy.linalg.inv(true @ X) @ Z if in_hand else numpy.linalg.inv(X) @ true @ Z
        place = seen[:3, 3]
        if not (place[2] > 0.15 and math.hypot(*place[:2]) < 0.55 * place[2] and abs(seen[2, 2]) > math.cos(1)):
            continue
        sight, noise = place / numpy.linalg.norm(place), random.standard_normal(3)
        along = sight * (noise @ sight)
        robot.append(told if wrong else told @ scattered(random, *NOISE))
        if off is None:
            target.append(pose(seen[:3, :3] @ turned(CAMERA[0] * random.standard_normal(3)), place + CAMERA[1] * (noise - along) + CAMERA[2] * along))
        else:
            target.append(pose_from_corners(random, seen, off))
    if size is not None:
        size **= random.choice((-1, 1))
        for T in target:
            T[:3, 3] /= size
    L, R = constant_errors(joints, tool, zeros, origins, axes)
    return numpy.array(robot), numpy.array(target), X, R @ X if in_hand else numpy.linalg.inv(L) @ X


def answer(calib, folder, setup, robot, target):
    """Transform and covariance; None where the program refuses."""
    numpy.savez(folder / "pairs.npz", robot=robot, target=target)
    done = subprocess.run([calib, "handeye", folder / "pairs.npz", "--setup", setup, "--force", "--quiet", "-o", folder / "pairs.json"],
                          capture_output=True, text=True)
    if done.returncode not in (0, 3):
        return None
    result = json.loads((folder / "pairs.json").read_text())
    x, y, z, w = result["transform"]["rotation_xyzw"]
    R = numpy.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
    told = any("focal length is" in warning or "times as large as stated" in warning for warning in result["warnings"])
    return pose(R, result["transform"]["translation"]), numpy.array(result["covariance"]), done.returncode, told


def judged(T, covariance, X):
    """Whether X lies inside of 95 %, and how far it is off, squared [m^2]."""
    D = numpy.linalg.inv(T) @ X
    error = numpy.concatenate([D[:3, 3], 0.5 * numpy.array([D[2, 1] - D[1, 2], D[0, 2] - D[2, 0], D[1, 0] - D[0, 1]])])
    return error @ numpy.linalg.solve(covariance, error) < CHI_SQUARE_95, error[:3] @ error[:3]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--calib", required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--runs", type=int, default=100, help="of each row")
    parser.add_argument("--only", choices=("scatter", "lens", "size"), help="rows of cameras that scatter, of lenses or of sizes that are off")
    options = parser.parse_args()
    print("| setup | poses | answered | of them exit code 3 | the scale is named | inside of 95 % | likewise, true base and gripper | off by, rms mm | likewise "
          "| stated, rms mm |")
    print("|" + "---|" * 10)
    kinds = {None: (*KINDS, *LENSES, *SIZES), "scatter": KINDS, "lens": LENSES, "size": SIZES}[options.only]
    with tempfile.TemporaryDirectory() as folder:
        for setup in ("eye-in-hand", "eye-to-hand"):
            for kind in kinds:
                threes, named, stated, found_there = 0, 0, [], []
                for run in range(options.runs):
                    robot, target, *truths = drawn(numpy.random.default_rng((options.seed, run)), setup, kind)
                    found = answer(options.calib, pathlib.Path(folder), setup, robot, target)
                    if found is None:
                        continue
                    T, covariance, code, told = found
                    threes += code == 3
                    named += told
                    stated.append(covariance[:3, :3].trace())
                    found_there.append([judged(T, covariance, X) for X in truths])
                shares, squares = numpy.array(found_there).mean(0).T
                rms = [1e3 * math.sqrt(value) for value in (*squares, numpy.mean(stated))]
                print(f"| {setup} | {kind} | {len(stated)} of {options.runs} | {threes} | {named} | {100 * shares[1]:.0f} % | {100 * shares[0]:.0f} % "
                      f"| {rms[1]:.2f} | {rms[0]:.2f} | {rms[2]:.2f} |", flush=True)


if __name__ == "__main__":
    main()
