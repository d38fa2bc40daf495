"""Plate: its gradient against differences, its bending on even triangles against closed forms."""
import math
import sys
import unittest

try:
    import numpy
except ModuleNotFoundError:
    sys.exit("skipped: numpy is not installed for this python")

import drape
import plate_statics

RATIO, POISSON, RIGIDITY = 1 / 3, 0.3, 2e-5


def even_triangles(count, side):
    """A patch of triangles of equal sides, on which the shape operator of a quadratic surface is exact."""
    rest = numpy.array([(side * (i + j / 2), side * j * math.sqrt(3) / 2) for j in range(count + 1) for i in range(count + 1)])
    corners = [(j * (count + 1) + i, i, j) for j in range(count) for i in range(count)]
    triangles = [t for a, _, _ in corners for t in ((a, a + 1, a + count + 1), (a + 1, a + count + 2, a + count + 1))]
    return rest, numpy.array(triangles)


class PlateTest(unittest.TestCase):
    def test_gradient_is_that_of_the_energy(self):
        rest, triangles = drape.disc(0.01)
        sheet = plate_statics.Plate(rest, triangles, 30, POISSON, RIGIDITY, 2, drape.clamped(rest), RATIO)
        draw = numpy.random.default_rng(0)
        x = numpy.c_[rest, numpy.zeros(len(rest))] + 0.001 * draw.normal(size=(len(rest), 3))
        along = draw.normal(size=x.shape)
        along[sheet.held] = 0
        step = 1e-8
        slope = (sheet.energy(x + step * along)[0] - sheet.energy(x - step * along)[0]) / (2 * step)
        self.assertAlmostEqual(slope, (sheet.energy(x)[1] * along).sum(), delta=1e-6 * abs(slope))

    def test_bending_of_cylinders_and_of_a_twist_is_that_of_a_plate(self):
        rest, triangles = even_triangles(8, 0.01)
        sheet = plate_statics.Plate(rest, triangles, 30, POISSON, RIGIDITY, 2, numpy.array([], int), RATIO)
        inner = numpy.bincount(sheet.hinges[:, 4:].ravel(), minlength=len(triangles)) == 3
        sheet.area = numpy.where(inner, sheet.area, 1e9)  # curvature is not known at the border: it counts for nothing there
        area, curvature = sheet.area[inner].sum(), 0.01
        for height, expected in ((rest[:, 0] ** 2 / 2, 1), (rest[:, 1] ** 2 / 2, RATIO),
                                 (rest[:, 0] * rest[:, 1], 2 * (1 - POISSON) * math.sqrt(RATIO))):
            x = numpy.c_[rest, curvature * height]
            energy = sheet.bending(x, numpy.zeros_like(x))
            self.assertAlmostEqual(energy / (RIGIDITY / 2 * curvature ** 2 * area), expected, delta=1e-5)


if __name__ == "__main__":
    unittest.main()
