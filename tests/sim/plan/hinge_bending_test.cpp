#include "sim/plan/hinge_bending.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "tests/sim/reference_scene.h"

namespace flash::sim {
namespace {

double hinge_energy(const Hinge& hinge, const HingePositions& x) {
  double energy;
  HingePositions gradient;
  hinge_response(hinge, x, energy, gradient, nullptr);
  return energy;
}

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
  const Hinge hinge{{0, 1, 2, 3}, 2.0, 3.0, {0.5, 0.5}};
  EXPECT_NEAR(hinge_energy(hinge, folded(-3.0)), std::pow(2 * M_PI - 6.0, 2), 1e-12);
}

HingePositions gradient_of(const Hinge& hinge, const HingePositions& x) {
  double energy;
  HingePositions gradient;
  hinge_response(hinge, x, energy, gradient, nullptr);
  return gradient;
}

/// Central differences over `step`.
HingePositions energy_slopes(const Hinge& hinge, const HingePositions& x, double step) {
  HingePositions slopes;
  for (int i = 0; i < 12; ++i) {
    HingePositions forward = x, backward = x;
    forward.data()[i] += step;
    backward.data()[i] -= step;
    slopes.data()[i] = (hinge_energy(hinge, forward) - hinge_energy(hinge, backward)) / (2 * step);
  }
  return slopes;
}

TEST(HingeBending, GradientIsTheDerivative) {
  std::mt19937 rng(1);
  for (int trial = 0; trial < 50; ++trial) {
    const Hinge hinge{{0, 1, 2, 3}, 1.7, 0.3, {0.4, 0.45}};
    const HingePositions x = random_hinge(rng), g = gradient_of(hinge, x);
    EXPECT_LT(g.rowwise().sum().norm(), 1e-13 * g.norm());
    // step^2 times third derivatives of some hundreds
    EXPECT_LT((g - energy_slopes(hinge, x, 1e-5)).cwiseAbs().maxCoeff(), 1e-7);
  }
}

TEST(HingeBending, ACollapsedTriangleLosesItsPartSmoothly) {
  std::mt19937 rng(3);
  const Hinge hinge{{0, 1, 2, 3}, 1.7, 0.3, {0.4, 0.45}};
  double largest = 0;
  for (int trial = 0; trial < 200; ++trial) {
    HingePositions x = random_hinge(rng);
    const double share = std::pow(10, -1.0 - 0.02 * trial);  // of its height: 0.1 to 1e-5
    x.col(3) = 0.5 * (x.col(0) + x.col(1)) + share * (x.col(3) - 0.5 * (x.col(0) + x.col(1)));
    const HingePositions g = gradient_of(hinge, x);
    // The height is the length over which the energy changes.
    const HingePositions slopes = energy_slopes(hinge, x, 1e-4 * share);
    EXPECT_LT((g - slopes).norm(), 1e-5 * (g.norm() + slopes.norm()) + 1e-12 / share) << share;
    largest = std::max(largest, g.norm());
  }
  // The angle's own gradient is 1 over the height: 1e5 in the end.
  EXPECT_LT(largest, 1.7 * 4 * M_PI / collapsed_share);
}

TEST(HingeBending, ATriangleOfATenthOfItsAreaBendsWhole) {
  std::mt19937 rng(4);
  const HingePositions x = random_hinge(rng);
  const double left = 0.5 * (x.col(1) - x.col(0)).cross(x.col(2) - x.col(0)).norm(),
               right = 0.5 * (x.col(0) - x.col(1)).cross(x.col(3) - x.col(1)).norm();
  const Hinge rest{{0, 1, 2, 3}, 1.7, 0.3, {left, right}},
      shrunk{{0, 1, 2, 3}, 1.7, 0.3, {9.99 * left, 9.99 * right}};
  EXPECT_EQ(hinge_energy(rest, x), hinge_energy(shrunk, x));
  EXPECT_EQ(gradient_of(rest, x), gradient_of(shrunk, x));
}

TEST(HingeBending, GaussNewtonIsTheHessianAtTheRestAngle) {
  std::mt19937 rng(2);
  const HingePositions x = random_hinge(rng);
  const Hinge hinge{{0, 1, 2, 3}, 1.7, hinge_angle(x), {0.4, 0.45}};
  double energy;
  HingePositions gradient;
  Matrix12 hessian;
  hinge_response(hinge, x, energy, gradient, &hessian);
  EXPECT_EQ(energy, 0.0);
  const double step = 1e-5;
  for (int i = 0; i < 12; ++i) {
    HingePositions forward = x, backward = x;
    forward.data()[i] += step;
    backward.data()[i] -= step;
    const HingePositions column = (gradient_of(hinge, forward) - gradient_of(hinge, backward)) / (2 * step);
    EXPECT_LT((hessian.col(i) - Eigen::Map<const Eigen::Matrix<double, 12, 1>>(column.data())).norm(),
              1e-6 * hessian.norm());
  }
}

double yielding_energy(const Hinge& hinge, const HingePositions& x, double limit) {
  double energy;
  HingePositions gradient;
  hinge_response(hinge, x, energy, gradient, nullptr, limit);
  return energy;
}

TEST(HingeBending, EnergyOfAYieldingHingeIsTheLeastOverAllThatMayFlow) {
  const Hinge hinge{{0, 1, 2, 3}, 1.7, 0.1, {0.5, 0.5}};
  const double limit = 0.4;
  for (const double fold : {-2.0, -0.35, -0.29, 0.2, 0.49, 0.51, 1.8}) {
    const double angle = fold - hinge.rest_angle;
    // 1/2 w (angle - p)^2 + w limit |p|: what is stored and what the flow p takes.
    double least = 1e300, flow = 0;
    for (int k = -200000; k <= 200000; ++k) {
      const double p = 1e-5 * k;
      const double energy = hinge.weight * (0.5 * (angle - p) * (angle - p) + limit * std::abs(p));
      if (energy < least) least = energy, flow = p;
    }
    // The grid misses the least by half of 1e-5 at most, the energy by its square.
    EXPECT_NEAR(yielding_energy(hinge, folded(fold), limit), least, 1e-10) << fold;
    EXPECT_NEAR(flow_of(hinge, folded(fold), limit), flow, 1e-5) << fold;
  }
}

TEST(HingeBending, ForceOfAYieldingHingeIsTheSlopeOfItsEnergy) {
  std::mt19937 rng(6);
  for (int k = 0; k < 20; ++k) {
    const HingePositions x = random_hinge(rng);
    // Within the limit and beyond it; the last pair of triangles is about to collapse.
    const double size = k < 15 ? 0.45 : 4.5;
    const Hinge hinge{{0, 1, 2, 3}, 1.7, hinge_angle(x) + 0.1 * (k % 5 - 2), {size, size}};
    const double limit = 0.15, step = 1e-6;
    double energy;
    HingePositions gradient;
    hinge_response(hinge, x, energy, gradient, nullptr, limit);
    for (int i = 0; i < 12; ++i) {
      HingePositions forward = x, backward = x;
      forward.data()[i] += step;
      backward.data()[i] -= step;
      const double slope =
          (yielding_energy(hinge, forward, limit) - yielding_energy(hinge, backward, limit)) / (2 * step);
      EXPECT_NEAR(gradient.data()[i], slope, 1e-8) << k;  // rounding of 1e-16 over 1e-6, and its square
    }
  }
}

TEST(HingeBending, WhatDoesNotYieldIsElasticToTheLastBit) {
  std::mt19937 rng(7);
  const HingePositions x = random_hinge(rng);
  const Hinge hinge{{0, 1, 2, 3}, 1.7, hinge_angle(x) + 0.2, {0.4, 0.45}};
  double elastic, yielding;
  HingePositions elastic_gradient, gradient;
  Matrix12 elastic_hessian, hessian;
  hinge_response(hinge, x, elastic, elastic_gradient, &elastic_hessian);
  hinge_response(hinge, x, yielding, gradient, &hessian, 0.21);
  EXPECT_EQ(yielding, elastic);
  EXPECT_EQ(gradient, elastic_gradient);
  EXPECT_EQ(hessian, elastic_hessian);
  EXPECT_EQ(flow_of(hinge, x, 0.21), 0);
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
  const nlohmann::json scene = reference_scene("unit_bending_hinge");
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
