#include "sim/hinge_bending.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "tests/sim/reference_scene.h"

namespace flash::sim {
namespace {

HingePositions random_hinge(std::mt19937& rng) {
  std::normal_distribution<double> noise(0, 0.15);
  HingePositions x;
  x << 0, 1, 0.4, 0.6, 0, 0, 0.8, -0.9, 0, 0, 0, 0;
  for (int i = 0; i < 12; ++i) x.data()[i] += noise(rng);
  return x;
}

// Two flaps over the x axis, the right one turned down by `fold`.
HingePositions folded(double fold) {
  HingePositions x;
  x << 0, 1, 0.5, 0.5, 0, 0, 1, -std::cos(fold), 0, 0, 0, -std::sin(fold);
  return x;
}

TEST(HingeBending, AngleIsTheFold) {
  for (const double fold : {-3.0, -1.2, 0.0, 1e-9, 0.4, 2.0, 3.1})
    EXPECT_NEAR(hinge_angle(folded(fold)), fold, 1e-14);
}

TEST(HingeBending, EnergyGoesTheShortWayRound) {
  const Hinge hinge{{0, 1, 2, 3}, 2.0, 3.0};
  EXPECT_NEAR(hinge_energy(hinge, folded(-3.0)), std::pow(2 * M_PI - 6.0, 2), 1e-12);
}

TEST(HingeBending, GradientAndHessianAreDerivatives) {
  std::mt19937 rng(1);
  for (int trial = 0; trial < 50; ++trial) {
    const Hinge hinge{{0, 1, 2, 3}, 1.7, 0.3};
    const HingePositions x = random_hinge(rng), g = hinge_gradient(hinge, x);
    const Matrix12 H = hinge_hessian(hinge, x);
    EXPECT_LT(g.rowwise().sum().norm(), 1e-13 * g.norm());
    for (int i = 0; i < 12; ++i) {
      const double step = 1e-5;
      HingePositions forward = x, backward = x;
      forward.data()[i] += step;
      backward.data()[i] -= step;
      const double slope = (hinge_energy(hinge, forward) - hinge_energy(hinge, backward)) / (2 * step);
      EXPECT_NEAR(g.data()[i], slope, 1e-7);  // step^2 times third derivatives of some hundreds
      const HingePositions column =
          (hinge_gradient(hinge, forward) - hinge_gradient(hinge, backward)) / (2 * step);
      EXPECT_LT((H.col(i) - Eigen::Map<const Eigen::Matrix<double, 12, 1>>(column.data())).norm(),
                1e-6 * H.norm());
    }
  }
}

TEST(HingeBending, GaussNewtonIsTheHessianAtTheRestAngle) {
  std::mt19937 rng(2);
  const HingePositions x = random_hinge(rng);
  const Hinge hinge{{0, 1, 2, 3}, 1.7, hinge_angle(x)};
  double energy;
  HingePositions gradient;
  Matrix12 hessian;
  hinge_response(hinge, x, energy, gradient, &hessian);
  EXPECT_EQ(energy, 0.0);
  EXPECT_LT((hessian - hinge_hessian(hinge, x)).norm(), 1e-12 * hessian.norm());
}

TEST(HingeBending, CurvedRestShapeIsAtRest) {
  data::TriangleMesh mesh;
  const HingePositions x = folded(0.7);
  mesh.vertices = x.transpose();
  mesh.triangles.resize(2, 3);
  mesh.triangles << 0, 1, 2, 1, 0, 3;
  const std::vector<Hinge> hinges = sheet_hinges(make_sheet(mesh));
  ASSERT_EQ(hinges.size(), 1u);
  EXPECT_NEAR(hinges[0].rest_angle, 0.7, 1e-14);
  EXPECT_NEAR(hinges[0].weight, 1.0, 1e-14);  // edge 1, two areas of 1/2
  EXPECT_EQ(hinge_energy(hinges[0], x), 0.0);
}

TEST(HingeBending, ReferenceScene) {
  FLASH_REFERENCE_SCENE(scene, "unit_bending_hinge");
  const Sheet sheet = make_sheet(reference_mesh(scene.at("mesh")));
  const data::Points x = reference_points(scene.at("x"));
  const double D = scene.at("bending").at("D");
  double energy = 0;
  data::Points force = data::Points::Zero(x.rows(), 3);
  for (const Hinge& hinge : sheet_hinges(sheet)) {
    HingePositions at, gradient;
    for (int i = 0; i < 4; ++i) at.col(i) = x.row(hinge.vertices[i]);
    double e;
    hinge_response(hinge, at, e, gradient, nullptr);
    energy += D * e;
    for (int i = 0; i < 4; ++i) force.row(hinge.vertices[i]) -= D * gradient.col(i);
  }
  const double expected = expected_quantity(scene, "energy");
  EXPECT_NEAR(energy, expected, 1e-6 * expected);
  const data::Points expected_force = reference_points(expected_quantity(scene, "force"));
  EXPECT_LT((force - expected_force).cwiseAbs().maxCoeff(), 1e-5 * expected_force.cwiseAbs().maxCoeff());
}

}  // namespace
}  // namespace flash::sim
