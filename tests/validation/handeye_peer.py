"""Errors in variables once more, to hold flash-calib's against: a bundle over X and Z with a correction of every robot
pose, at noise levels that are stated and not estimated (0.1 deg, 1 mm, 0.2 px), lens and target as stated."""
import numpy

CORNER, TURN, SHIFT = 0.2, numpy.radians(0.1), 1e-3


def skew(v):
    x, y, z = v
    return numpy.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def exponential(v):
    angle = numpy.linalg.norm(v)
    if angle < 1e-12:
        return numpy.eye(3) + skew(v)
    K = skew(v / angle)
    return numpy.eye(3) + numpy.sin(angle) * K + (1 - numpy.cos(angle)) * K @ K


def logarithm(R):
    axis = numpy.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    sine = numpy.linalg.norm(axis)
    angle = numpy.arctan2(sine, (numpy.trace(R) - 1) / 2)
    return axis if sine < 1e-9 else axis * angle / sine


def pose(numbers):
    """Of x y z qx qy qz qw."""
    x, y, z, w = numbers[3:]
    T = numpy.eye(4)
    T[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                 [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                 [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    T[:3, 3] = numbers[:3]
    return T


def moved(T, xi):
    step = numpy.eye(4)
    step[:3, :3], step[:3, 3] = exponential(xi[3:]), xi[:3]
    return T @ step


def inverse(T):
    R = numpy.eye(4)
    R[:3, :3], R[:3, 3] = T[:3, :3].T, -T[:3, :3].T @ T[:3, 3]
    return R


def project(lens, q):
    """Places in the camera to pixels (Brown's model), 3 x N to 2 x N."""
    k1, k2, p1, p2, k3 = (list(lens["distortion"]) + 5 * [0])[:5]
    x, y = q[0] / q[2], q[1] / q[2]
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return numpy.array([lens["focal_px"][0] * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + lens["centre_px"][0],
                        lens["focal_px"][1] * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + lens["centre_px"][1]])


class Views:
    """What was seen: robot poses, the target's pose of each view alone, its corners."""

    def __init__(self, result, detections, lens):
        corners = {view["image"]: reading for view in detections["views"] for reading in view["readings"]
                   if reading["refiner"] == result["provenance"]["refiner"]}
        used = [view for view in result["views"] if view["used"]]
        assert not any(view["renumbered"] for view in used), "corners are numbered otherwise than they were found"
        points = numpy.array(detections["target_points"]).T
        self.lens = lens
        self.in_hand = result["setup"] == "eye-in-hand"
        self.robot = [pose(view["base_gripper"]) for view in used]
        self.seen = [pose(view["camera_target"]) for view in used]
        self.points = [points[:, corners[view["image"]]["points"]] for view in used]
        self.pixels = [numpy.array(corners[view["image"]]["pixels"]).T for view in used]

    def chain(self, i, X, Z, robot):
        """The target in the camera."""
        return inverse(X) @ inverse(robot) @ Z if self.in_hand else inverse(X) @ robot @ Z

    def residual(self, i, X, Z, correction):
        T = self.chain(i, X, Z, moved(self.robot[i], correction))
        q = T[:3, :3] @ self.points[i] + T[:3, 3:]
        return (project(self.lens, q) - self.pixels[i]).T.ravel() / CORNER


def linearized(views, i, X, Z, correction):
    """Residuals of one view and their derivatives by X, Z and its correction, central differences."""
    J, h = [], 1e-6
    for block in range(3):
        for axis in range(6):
            step = numpy.zeros(6)
            step[axis] = h
            sides = [(moved(X, s * step) if block == 0 else X, moved(Z, s * step) if block == 1 else Z,
                      correction + s * step if block == 2 else correction) for s in (1, -1)]
            J.append((views.residual(i, *sides[0]) - views.residual(i, *sides[1])) / (2 * h))
    J = numpy.array(J).T
    return views.residual(i, X, Z, correction), J[:, :12], J[:, 12:]


def solve(views, chosen, X):
    """X and Z by Gauss and Newton, corrections eliminated view by view; from X, with corners down-weighted at first."""
    prior = numpy.diag([SHIFT ** -2] * 3 + [TURN ** -2] * 3)
    first = chosen[0]
    Z = (views.robot[first] @ X if views.in_hand else inverse(views.robot[first]) @ X) @ views.seen[first]
    corrections = {i: numpy.zeros(6) for i in chosen}
    for round_ in range(30):
        weight = min(1.0, 10.0 ** (round_ - 4))
        A, b, own = numpy.zeros((12, 12)), numpy.zeros(12), {}
        for i in chosen:
            r, J, D = linearized(views, i, X, Z, corrections[i])
            H = weight * D.T @ D + prior
            g = weight * D.T @ r + prior @ corrections[i]
            C = weight * D.T @ J
            own[i] = (H, g, C)
            A += weight * J.T @ J - C.T @ numpy.linalg.solve(H, C)
            b += weight * J.T @ r - C.T @ numpy.linalg.solve(H, g)
        step = -numpy.linalg.solve(A, b)
        X, Z = moved(X, step[:6]), moved(Z, step[6:])
        for i, (H, g, C) in own.items():
            corrections[i] = corrections[i] - numpy.linalg.solve(H, g + C @ step)
        if weight == 1 and numpy.linalg.norm(step) < 1e-9:
            break
    return X, Z


def squares(views, i, X, Z):
    """px, mm and deg of a view, squared, as flash-calib counts them."""
    px = CORNER ** 2 * numpy.sum(views.residual(i, X, Z, numpy.zeros(6)) ** 2) / views.points[i].shape[1]
    T, seen = views.chain(i, X, Z, views.robot[i]), views.seen[i]
    centre = views.points[i].mean(axis=1)
    apart = (T[:3, :3] - seen[:3, :3]) @ centre + T[:3, 3] - seen[:3, 3]
    return numpy.array([px, 1e6 * apart @ apart, numpy.degrees(numpy.linalg.norm(logarithm(T[:3, :3].T @ seen[:3, :3]))) ** 2])


def held_out(views, X, part_of):
    """Each part of the views predicted by the others. Means over the views of each part, parts x 3; and over all views, weighted
    as flash-calib does."""
    views_of = [[i for i, own in enumerate(part_of) if own == part] for part in range(max(part_of) + 1)]
    each, corners = [], []
    for left_out in views_of:
        own = solve(views, [i for i in range(len(part_of)) if i not in left_out], X)
        each.append([squares(views, i, *own) for i in left_out])
        corners += [views.points[i].shape[1] for i in left_out]
    every = numpy.concatenate(each)
    rms = numpy.sqrt([numpy.average(every[:, 0], weights=corners), every[:, 1].mean(), every[:, 2].mean()])
    return numpy.array([numpy.mean(fold, axis=0) for fold in each]), rms


def halves_apart(views, X, first_halves):
    """[mm] at the middle of where the target was seen, by split."""
    middle = numpy.mean([(X @ seen)[:3, :3] @ points.mean(axis=1) + (X @ seen)[:3, 3]
                         for seen, points in zip(views.seen, views.points)], axis=0)
    apart = []
    for half in first_halves:
        A, B = (solve(views, chosen, X)[0] for chosen in (half, [i for i in range(len(views.robot)) if i not in half]))
        T = A @ inverse(B)
        apart.append(1000 * numpy.linalg.norm(T[:3, :3] @ middle + T[:3, 3] - middle))
    return apart
