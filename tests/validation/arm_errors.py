#!/usr/bin/env python3
"""Over which reach the errors of arms agree: of drawn arms whose zeros, links, axes and gears are off, how likely each size and reach of
the fields is that flash-calib expects (calib/uncertainty/correlated_pose_errors). Here the errors themselves are known, without pictures,
and computed by this file alone. The prior of the program is from a run of it."""
import argparse
import math

import numpy

# Of each joint: where it stands in the link before [m] and its axis; then the gripper in the last link, and a usual pose [rad].
X, Y, Z = (1, 0, 0), (0, 1, 0), (0, 0, 1)
ARMS = {
    "UR5": ([((0, 0, 0.089), Z), ((0, 0.13, 0), Y), ((0.425, -0.12, 0), Y), ((0.392, 0, 0), Y), ((0, 0.093, 0), (0, 0, -1)), ((0, 0, -0.095), Y)],
            (0, 0.08, 0), (0, -1.2, 1.5, -1.9, -1.57, 0)),
    "KR6": ([((0, 0, 0.34), Z), ((0.02, 0, 0.06), Y), ((0.455, 0, 0), Y), ((0, 0, 0.035), X), ((0.42, 0, 0), Y), ((0.08, 0, 0), X)],
            (0.03, 0, 0), (0, -0.8, 1.2, 0, 1.0, 0)),
    "Panda": ([((0, 0, 0.333), Z), ((0, 0, 0), Y), ((0, 0, 0.316), Z), ((0.0825, 0, 0), (0, -1, 0)), ((-0.0825, 0, 0.384), Z), ((0, 0, 0), (0, -1, 0)),
               ((0.088, 0, 0), (0, 0, -1))], (0, 0, -0.107), (0, -0.3, 0, -2.2, 0, 2.0, 0.8))}
# Standard deviations of zeros [deg], links [mm], axes [deg] and of a harmonic of each gear [deg].
ERRORS = ((0.05, 0.3, 0, 0), (0.1, 0.5, 0, 0), (0.1, 0.2, 0.05, 0.05), (0.2, 0.5, 0.1, 0.1))
SPREADS = (0.05, 0.1, 0.2, 0.4, 0.6, 0.9)  # of the joints, either way [rad]
NOISES = (2e-5, 2e-4)  # independent errors [m, rad]
REACHES = (0.25, 0.5, 1, 2, 4, 8, 16, 32)  # [rad], places over BASE_AWAY
SIZES = tuple(1e-4 * 2 ** k for k in range(9))  # turns [rad]
BASE_AWAY = 0.6  # [m]
VIEWS = 16


def cross_matrix(v):
    return numpy.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def turned(w):
    angle = numpy.linalg.norm(w)
    K = cross_matrix(w / angle) if angle > 0 else numpy.zeros((3, 3))
    return numpy.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K


def gripper(joints, tool, q, origins, axes):
    """Rotation and place; origins and axes: by how much each is off."""
    R, t = numpy.eye(3), numpy.zeros(3)
    for (origin, axis), angle, shift, tilt in zip(joints, q, origins, axes):
        t = t + R @ (numpy.array(origin) + shift)
        R = R @ turned(tilt) @ turned(angle * numpy.array(axis, float))
    return R, t + R @ (numpy.array(tool) + origins[-1])


def session(random, arm, errors, spread):
    """Poses as the arm's model has them, and their errors (shift, turn) in base axes."""
    joints, tool, home = ARMS[arm]
    count, degree = len(joints), math.pi / 180
    zero, length, axis, gear = errors
    zeros, harmonics = random.normal(0, zero * degree, count), random.normal(0, gear * degree, count)
    phases, origins = random.uniform(0, 2 * math.pi, count), random.normal(0, 1e-3 * length, (count + 1, 3))
    axes, right = random.normal(0, axis * degree, (count, 3)), (numpy.zeros((count + 1, 3)), numpy.zeros((count, 3)))
    middle = numpy.array(home) + random.uniform(-0.4, 0.4, count)
    poses, rows = [], []
    for q in middle + random.uniform(-spread, spread, (VIEWS, count)):
        R, t = gripper(joints, tool, q, *right)
        R_true, t_true = gripper(joints, tool, q + zeros + harmonics * numpy.sin(q + phases), origins, axes)
        difference = R_true @ R.T
        poses.append((R, t))
        rows.append([*(t_true - t), *(0.5 * (difference[i, j] - difference[j, i]) for i, j in ((2, 1), (0, 2), (1, 0)))])
    return poses, numpy.array(rows).ravel()


def field_covariances(poses):
    """Of fields of unit size, by reach."""
    rotations, places = numpy.array([R for R, _ in poses]), numpy.array([t for _, t in poses])
    apart = ((places[:, None] - places) ** 2).sum(-1), 0.5 * ((rotations[:, None] - rotations) ** 2).sum((-1, -2))
    squared = apart[0] / BASE_AWAY ** 2 + apart[1]
    I, O = numpy.eye(3), numpy.zeros((3, 3))
    stretch = [numpy.column_stack([0.5 * p, O[:, :2]]) for p in places - places.mean(0)]
    modes = [[numpy.vstack(pair) for pair in ((O, R), (-cross_matrix(p), I), (BASE_AWAY * math.sqrt(2 / 3 + 1 / 4 + 1 / 12) * I, O),
                                              (0.5 * BASE_AWAY * R, O), (along, O))]
             for R, p, along in zip(rotations, places - places.mean(0), stretch)]
    B = numpy.array(modes)  # pose, mode, 6, 3
    alike = numpy.einsum("imac,jmbc->iajb", B, B)
    result = []
    for reach in REACHES:
        x = numpy.sqrt(5 * squared) / reach
        matern = (1 + x + x * x / 3) * numpy.exp(-x)
        result.append((alike * matern[:, None, :, None]).reshape(6 * VIEWS, 6 * VIEWS))
    return result


def probabilities(poses, errors, noise):
    """Of each reach and size, all alike likely beforehand."""
    logs = numpy.empty((len(REACHES), len(SIZES)))
    for i, K in enumerate(field_covariances(poses)):
        for j, size in enumerate(SIZES):
            root = numpy.linalg.cholesky(size ** 2 * K + noise ** 2 * numpy.eye(len(K)))
            logs[i, j] = -0.5 * (numpy.linalg.solve(root, errors) ** 2).sum() - numpy.log(root.diagonal()).sum()
    weights = numpy.exp(logs - logs.max())
    return weights / weights.sum()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--arms", type=int, default=8, help="drawn of each kind")
    options = parser.parse_args()
    random = numpy.random.default_rng(options.seed)
    print("| arm | joints either way rad | zeros deg, links mm, axes deg, gears deg | " + " | ".join(f"reach {r:g}" for r in REACHES) + " | size deg |")
    print("|" + "---|" * (len(REACHES) + 4))
    total = numpy.zeros(len(REACHES))
    kinds = [(arm, spread, errors) for arm in ARMS for spread in SPREADS for errors in ERRORS]
    for arm, spread, errors in kinds:
        mean = sum(probabilities(*session(random, arm, errors, spread), noise) for noise in NOISES for _ in range(options.arms))
        mean /= len(NOISES) * options.arms
        total += mean.sum(1) / len(kinds)
        size = math.degrees(math.exp(mean.sum(0) @ numpy.log(SIZES)))
        print(f"| {arm} | {spread:g} | {', '.join(f'{e:g}' for e in errors)} | " + " | ".join(f"{p:.2f}" for p in mean.sum(1)) + f" | {size:.2f} |")
    print("| all | | | " + " | ".join(f"{p:.2f}" for p in total) + " | |")


if __name__ == "__main__":
    main()
