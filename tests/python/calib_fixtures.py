"""Drawn cells: poses of a robot and of a target, and corners of that target in pictures, with the truth."""
import numpy as np

CAMERA_NUMBERS = (640, 480, 610.0, 612.0, 322.0, 239.0, (-0.11, 0.07, 0.0004, -0.0003, 0.0))


def turned(v):
    """The rotation about v by its length."""
    angle = np.linalg.norm(v)
    if angle == 0:
        return np.eye(3)
    x, y, z = v / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def pose(v, t):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = turned(np.asarray(v, float)), t
    return T


X_IN_HAND, Z_IN_HAND = pose((0.1, -0.2, 1.5), (0.03, -0.05, 0.08)), pose((3.0, 0.1, 0.2), (0.5, 0.1, 0.02))
X_TO_HAND, Z_TO_HAND = pose((2.0, 0.3, -0.4), (0.9, -0.2, 0.6)), pose((0.2, 0.1, -0.7), (0.01, 0.02, 0.12))


def cell(setup, count=16, seed=1, noise=(5e-4, 5e-4), sight=(1e-3, 2e-4)):
    """T_base_gripper, T_camera_target, X, Z. noise: of the robot [rad, m]; sight: of the target, likewise."""
    random = np.random.default_rng(seed)
    X, Z = (X_IN_HAND, Z_IN_HAND) if setup == "eye-in-hand" else (X_TO_HAND, Z_TO_HAND)
    robot, target = [], []
    for _ in range(count):
        C = pose(random.uniform((-0.6, -0.6, -0.7), (0.6, 0.6, 0.7)), random.uniform((-0.05, -0.04, 0.4), (0.05, 0.04, 0.6)))
        G = Z @ np.linalg.inv(C) @ np.linalg.inv(X) if setup == "eye-in-hand" else X @ C @ np.linalg.inv(Z)
        robot.append(G @ pose(noise[0] * random.standard_normal(3), noise[1] * random.standard_normal(3)))
        target.append(C @ pose(sight[0] * random.standard_normal(3), sight[1] * random.standard_normal(3)))
    return np.array(robot), np.array(target), X, Z


def board(columns=6, rows=5, side=0.03):
    """Inner corners of a chessboard, row by row."""
    y, x = np.mgrid[:rows, :columns]
    return np.stack([side * x.ravel(), side * y.ravel(), np.zeros(x.size)], axis=1)


def project(points, T_camera_target, numbers=CAMERA_NUMBERS):
    """(M, 2) by OpenCV's formula."""
    _, _, fx, fy, cx, cy, (k1, k2, p1, p2, k3) = numbers
    q = points @ T_camera_target[:3, :3].T + T_camera_target[:3, 3]
    x, y = q[:, 0] / q[:, 2], q[:, 1] / q[:, 2]
    r = x * x + y * y
    radial = 1 + k1 * r + k2 * r**2 + k3 * r**3
    return np.stack([fx * (x * radial + 2 * p1 * x * y + p2 * (r + 2 * x * x)) + cx,
                     fy * (y * radial + p1 * (r + 2 * y * y) + 2 * p2 * x * y) + cy], axis=1)


def pictures(setup, count=16, seed=1, pixel=0.1, points=None, numbers=CAMERA_NUMBERS):
    """T_base_gripper, corners (N, M, 2), points, X, Z: of a target that the camera sees near the middle of its picture."""
    points = board() if points is None else points
    robot, target, X, Z = cell(setup, count, seed, sight=(0, 0))
    middle = pose((0, 0, 0), -points.mean(axis=0))
    seen = np.array([project(points, C @ middle, numbers) for C in target])
    return robot, seen + pixel * np.random.default_rng(seed + 1).standard_normal(seen.shape), points, X, Z @ middle


def off(T, X):
    """(6,) by which X is off T: d, r with X = T [Exp(r), d] to first order."""
    D = np.linalg.inv(T) @ X
    return np.concatenate([D[:3, 3], 0.5 * np.array([D[2, 1] - D[1, 2], D[0, 2] - D[2, 0], D[1, 0] - D[0, 1]])])
