"""A thin sheet at rest, by a method that shares nothing with flash: triangles of StVenant and Kirchhoff, bending from the
turns at edges as a shape operator of each triangle (Grinspun, Gingold, Reisman, Zorin 2006, "Computing discrete shape
operators on general meshes"), and the least energy by L-BFGS (Nocedal 1980)."""
import numpy

HISTORY = 40  # steps that the method remembers
LONGEST = 5e-3  # of a vertex in a step [m]
ARMIJO = 1e-4


class Plate:
    """A flat sheet of vertices `rest` (n x 2) [m] and `triangles`, all seen from above counter-clockwise.

    membrane_stiffness: E t [N/m]; bending_rigidity: D_1, along x [N m]; bending_ratio: D_2 / D_1; weight: per area [N/m^2];
    held: vertices that stay where they start."""

    def __init__(self, rest, triangles, membrane_stiffness, poissons_ratio, bending_rigidity, weight, held, bending_ratio=1.0):
        self.triangles, self.held, self.rigidity = triangles, held, bending_rigidity
        self.free = numpy.setdiff1d(numpy.arange(len(rest)), held)
        sides = rest[triangles[:, 1:]] - rest[triangles[:, :1]]  # rows: two sides of each triangle
        self.area = numpy.linalg.det(sides) / 2
        self.from_rest = numpy.linalg.inv(numpy.swapaxes(sides, 1, 2))
        plane = membrane_stiffness / (1 - poissons_ratio ** 2)
        self.lame = plane * poissons_ratio, plane * (1 - poissons_ratio) / 2
        of_vertex = numpy.zeros(len(rest))
        numpy.add.at(of_vertex, triangles, self.area[:, None] / 3)
        self.load = weight * of_vertex
        root = bending_ratio ** 0.5
        self.moments = numpy.array([[1, poissons_ratio * root, 0], [poissons_ratio * root, bending_ratio, 0],
                                    [0, 0, 2 * (1 - poissons_ratio) * root]])  # of curvatures xx, yy, xy, over D_1
        self.hinges = self.inner_edges()
        along = rest[self.hinges[:, 1]] - rest[self.hinges[:, 0]]
        self.length = numpy.linalg.norm(along, axis=1)
        across = numpy.c_[-along[:, 1], along[:, 0]] / self.length[:, None]
        self.turns = numpy.c_[across[:, 0] ** 2, across[:, 1] ** 2, across[:, 0] * across[:, 1]]

    def inner_edges(self):
        """Rows: both ends, the vertex left of the edge, the one right of it, their triangles."""
        beside = {}
        for t, corners in enumerate(self.triangles):
            for k in range(3):
                a, b, opposite = corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]
                beside.setdefault((min(a, b), max(a, b)), []).append((a, b, opposite, t))
        return numpy.array([(a, b, left, right, s, t) for (a, b, left, s), (_, _, right, t) in
                            (both for both in beside.values() if len(both) == 2)])

    def membrane(self, x, gradient):
        corners = self.triangles
        sides = numpy.stack([x[corners[:, 1]] - x[corners[:, 0]], x[corners[:, 2]] - x[corners[:, 0]]], -1)
        deformation = sides @ self.from_rest
        strain = (numpy.swapaxes(deformation, 1, 2) @ deformation - numpy.eye(2)) / 2
        trace = strain[:, 0, 0] + strain[:, 1, 1]
        first, second = self.lame
        stress = first * trace[:, None, None] * numpy.eye(2) + 2 * second * strain
        forces = self.area[:, None, None] * (deformation @ stress) @ numpy.swapaxes(self.from_rest, 1, 2)
        for k in range(2):
            numpy.add.at(gradient, corners[:, 1 + k], forces[:, :, k])
        numpy.add.at(gradient, corners[:, 0], -forces.sum(2))
        return (self.area * (first / 2 * trace ** 2 + second * (strain ** 2).sum((1, 2)))).sum()

    def bending(self, x, gradient):
        a, b, left, right, first, second = self.hinges.T
        edge = x[b] - x[a]
        up, over = numpy.cross(edge, x[left] - x[a]), numpy.cross(x[right] - x[a], edge)
        squared_up, squared_over = (up ** 2).sum(1), (over ** 2).sum(1)
        length = numpy.linalg.norm(edge, axis=1)
        angle = numpy.arctan2((numpy.cross(up, over) * edge).sum(1) / length, (up * over).sum(1))
        curvature = numpy.zeros((len(self.area), 3))
        for t in (first, second):
            numpy.add.at(curvature, t, (angle * self.length / 2)[:, None] * self.turns)
        curvature /= self.area[:, None]
        moment = self.rigidity * curvature @ self.moments
        by_angle = self.length / 2 * ((moment[first] + moment[second]) * self.turns).sum(1)
        by_left, by_right = -(length / squared_up)[:, None] * up, -(length / squared_over)[:, None] * over
        place = [((x[tip] - x[a]) * edge).sum(1) / length ** 2 for tip in (left, right)]
        by_b = -place[0][:, None] * by_left - place[1][:, None] * by_right
        for vertex, slope in ((a, -by_b - by_left - by_right), (b, by_b), (left, by_left), (right, by_right)):
            numpy.add.at(gradient, vertex, by_angle[:, None] * slope)
        return (self.area * (curvature * moment).sum(1)).sum() / 2

    def energy(self, x):
        """Energy [J] at positions x (n x 3) [m], and its gradient, zero where the sheet is held [N]."""
        gradient = numpy.zeros_like(x)
        energy = self.membrane(x, gradient) + self.bending(x, gradient) + self.load @ x[:, 2]
        gradient[:, 2] += self.load
        gradient[self.held] = 0
        return energy, gradient

    def settle(self, start, tolerance, iterations):
        """Positions of least energy from `start`, and what is left of the force over the weight."""
        x = start.copy()
        energy, gradient = self.energy(x)
        weight, moves, changes = numpy.linalg.norm(self.load), [], []
        for _ in range(iterations):
            force = gradient[self.free].ravel()
            if numpy.linalg.norm(force) < tolerance * weight:
                break
            step = self.direction(force, moves, changes)
            share = min(1, LONGEST / abs(step).max())
            while True:
                trial = x.copy()
                trial[self.free] -= share * step.reshape(-1, 3)
                trial_energy, trial_gradient = self.energy(trial)
                if trial_energy <= energy - ARMIJO * share * (force @ step) or share < 1e-12:
                    break
                share /= 2
            move, change = (trial - x)[self.free].ravel(), (trial_gradient - gradient)[self.free].ravel()
            if move @ change > 0:
                moves.append(move)
                changes.append(change)
                del moves[:-HISTORY], changes[:-HISTORY]
            x, energy, gradient = trial, trial_energy, trial_gradient
        return x, numpy.linalg.norm(gradient) / weight

    @staticmethod
    def direction(force, moves, changes):
        """The inverse Hessian of the steps so far times the force."""
        step, shares = force.copy(), []
        for move, change in zip(reversed(moves), reversed(changes)):
            shares.append((move @ step) / (move @ change))
            step -= shares[-1] * change
        step *= (moves[-1] @ changes[-1]) / (changes[-1] @ changes[-1]) if moves else 1e-4 / abs(step).max()
        for move, change, share in zip(moves, changes, reversed(shares)):
            step += (share - (change @ step) / (move @ change)) * move
        return step
