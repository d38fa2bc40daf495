// Solids through the solver against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "data/files/error.h"
#include "sim/batch.h"
#include "sim/device_limits.h"
#include "tests/sim/solid_scene.h"

namespace flash::sim {
namespace {

using data::Constitutive;
using data::Points;
using Eigen::Vector3d;

constexpr Constitutive models[] = {Constitutive::tet_arap, Constitutive::tet_corotated,
                                   Constitutive::tet_neohookean, Constitutive::tet_neohookean_log};

/// Mean displacement along an axis over the face where that axis is `value`, by the area of its triangles.
double mean_on_face(const Sheet& sheet, const Points& x, int axis, double value) {
  double area = 0, sum = 0;
  for (Eigen::Index f = 0; f < sheet.solid_surface.rows(); ++f) {
    const Eigen::Vector3i v = sheet.solid_surface.row(f);
    const Points corners = sheet.rest.vertices(v, Eigen::all);
    if ((corners.col(axis).array() - value).abs().maxCoeff() > 1e-9) continue;
    const Vector3d a = corners.row(1) - corners.row(0), b = corners.row(2) - corners.row(0);
    const double own = 0.5 * a.cross(b).norm();
    area += own;
    for (const int i : v) sum += own / 3 * (x(i, axis) - value);
  }
  return sum / area;
}

// Hung by its top it grows by rho g L^2 / (2 E), exactly so in the mean over the face where nu = 0: a
// displacement that depends on the height alone is in the space of linear elements. Strains are 2e-4.
TEST(Solids, ABarGrowsUnderItsOwnWeight) {
  const double length = 0.2, density = 1000, E = 1e7;
  const Sheet bar = solid_box({0.04, 0.04, length}, {2, 2, 5});
  for (const Constitutive model : models) {
    Environment environment = solid_environment(
        bar, {.constitutive = model, .youngs_modulus = E, .poissons_ratio = 0, .density = density});
    environment.holds = {roller(bar, face_of(bar, 2, length), 2, length),
                         roller(bar, face_of(bar, 0, 0), 0, 0), roller(bar, face_of(bar, 1, 0), 1, 0)};
    const StepReport report = settle(bar, environment);
    EXPECT_TRUE(report.converged);
    const double growth = -mean_on_face(bar, environment.state.positions, 2, 0);
    const double expected = density * 9.81 * length * length / (2 * E);
    EXPECT_NEAR(growth, expected, 1e-3 * expected);
    EXPECT_NEAR(report.hold_forces[0].z(), density * 9.81 * 0.04 * 0.04 * length, 1e-6);
  }
}

/// First Piola-Kirchhoff stress along a box that is stretched by s and kept from growing across.
double confined_stress(Constitutive model, double E, double nu, double s) {
  const double mu = E / (2 * (1 + nu)), lambda = E * nu / ((1 + nu) * (1 - 2 * nu));
  const double m = 4 * mu / 3, l = lambda + 5 * mu / 6;
  if (model == Constitutive::tet_arap) return 2 * mu * (s - 1);
  if (model == Constitutive::tet_neohookean_log)
    return m * s * (1 - 1 / (s * s + 3)) + l * (s - 1) - 0.75 * m;
  return (lambda + 2 * mu) * (s - 1);  // the oedometric modulus E (1 - nu) / ((1 + nu) (1 - 2 nu))
}

// A homogeneous strain is exact on any mesh, at any Poisson's ratio: what remains is the solver's tolerance.
TEST(Solids, ABoxIsPressedInAMould) {
  const Vector3d size(0.1, 0.08, 0.06);
  const Sheet box = solid_box(size, {3, 2, 2});
  for (const double nu : {0.0, 0.3, 0.49})
    for (const Constitutive model : models) {
      Environment environment = solid_environment(
          box, {.constitutive = model, .youngs_modulus = 5e4, .poissons_ratio = nu, .density = 100});
      environment.gravity.setZero();
      // The corotated law loses its ellipticity where lambda tr(e) < -2 mu: pressed so far, the inside
      // buckles.
      const double s = nu < 0.4 ? 0.9 : 0.99;
      environment.holds = {roller(box, face_of(box, 2, size.z()), 2, s * size.z())};
      for (int axis = 0; axis < 3; ++axis)
        environment.holds.push_back(roller(box, face_of(box, axis, 0), axis, 0));
      for (int axis = 0; axis < 2; ++axis)
        environment.holds.push_back(roller(box, face_of(box, axis, size[axis]), axis, size[axis]));
      const StepReport report = settle(box, environment);
      EXPECT_TRUE(report.converged);
      const double expected = size.x() * size.y() * confined_stress(model, 5e4, nu, s);
      EXPECT_NEAR(report.hold_forces[0].z(), expected, 1e-6 * std::abs(expected));
      for (Eigen::Index i = 0; i < box.rest.vertices.rows(); ++i)
        EXPECT_NEAR(environment.state.positions(i, 2), s * box.rest.vertices(i, 2), 1e-8);
    }
}

// Lateral stretch q and pull P per area of the stable neo-Hookean bar without its logarithm: no stress
// across, mu = s (mu - (lambda + mu) (q^2 s - 1)), and P = mu (s - q^2 / s).
TEST(Solids, ANeoHookeanBarIsDrawnAndPressed) {
  const Vector3d size(0.15, 0.1, 0.1);
  const Sheet bar = solid_box(size, {3, 2, 2});
  const double E = 1e5;
  for (const double nu : {0.3, 0.45})
    for (const double s : {0.6, 1.02, 2.0}) {
      const double mu = E / (2 * (1 + nu)), lambda = E * nu / ((1 + nu) * (1 - 2 * nu));
      Environment environment =
          solid_environment(bar, {.youngs_modulus = E, .poissons_ratio = nu, .density = 100});
      environment.gravity.setZero();
      for (int axis = 0; axis < 3; ++axis)
        environment.holds.push_back(roller(bar, face_of(bar, axis, 0), axis, 0));
      environment.holds.push_back(roller(bar, face_of(bar, 0, size.x()), 0, s * size.x()));
      const StepReport report = settle(bar, environment);
      EXPECT_TRUE(report.converged);
      const double q2 = (1 + mu * (1 - 1 / s) / (lambda + mu)) / s;
      const double pull = mu * (s - q2 / s) * size.y() * size.z();
      EXPECT_NEAR(report.hold_forces[3].x(), pull, 1e-6 * std::abs(pull)) << nu << ' ' << s;
      for (const int i : face_of(bar, 1, size.y()))
        EXPECT_NEAR(environment.state.positions(i, 1), std::sqrt(q2) * size.y(), 1e-7);
    }
}

/// How far the tip of a clamped beam goes down under its weight [m]: its mean over the end.
double tip_of_cantilever(int cells, double density) {
  const Vector3d size(0.3, 0.025, 0.1);
  const Sheet beam = solid_box(size, {3 * cells, cells / 4, cells});
  Environment environment = solid_environment(
      beam, {.constitutive = Constitutive::tet_corotated, .poissons_ratio = 0, .density = density});
  environment.holds = {{.vertices = face_of(beam, 0, 0)}};
  EXPECT_TRUE(settle(beam, environment, 1e-6).converged);
  double drop = 0;
  const std::vector<int> end = face_of(beam, 0, size.x());
  for (const int i : end) drop += beam.rest.vertices(i, 2) - environment.state.positions(i, 2);
  return drop / static_cast<double>(end.size());
}

// Timoshenko: w L^4 / (8 E I) + w L^2 / (2 kappa G A), kappa = 5/6, to which a clamp that keeps its section
// plane adds less than the beam's thickness over its length squared times 0.1. Without lateral contraction
// the clamp has no singular edge, and linear elements err by the square of the cell.
TEST(Solids, ACantileverConvergesWithTheSquareOfTheCell) {
  const double E = 1e5, density = 0.5, L = 0.3, b = 0.025, a = 0.1, w = density * 9.81 * a * b;
  const double I = b * a * a * a / 12, G = E / 2;
  const double expected = w * std::pow(L, 4) / (8 * E * I) + w * L * L / (2 * 5.0 / 6 * G * a * b);
  const double coarse = tip_of_cantilever(4, density), middle = tip_of_cantilever(8, density),
               fine = tip_of_cantilever(16, density);
  const double order = std::log2((middle - coarse) / (fine - middle));
  EXPECT_NEAR(order, 2, 0.25);
  const double limit = fine + (fine - middle) / 3;
  EXPECT_NEAR(limit, expected, 0.012 * expected) << coarse << ' ' << middle << ' ' << fine << ' ' << order;
}

/// The torque that twists a square bar by a small angle, its ends free to warp, from its energy [N m].
double torque_of_bar(int cells, double side, double length, double E, double nu, double angle) {
  const Sheet bar = solid_box({length, side, side}, {2 * cells, cells, cells});
  Environment environment = solid_environment(bar, {.youngs_modulus = E, .poissons_ratio = nu, .density = 1});
  environment.gravity.setZero();
  const Eigen::RowVector2d centre(side / 2, side / 2);
  for (const double x : {0.0, length}) {
    Hold hold{.vertices = face_of(bar, 0, x), .axes = {false, true, true}};
    hold.targets = bar.rest.vertices(hold.vertices, Eigen::all);
    const Eigen::Matrix2d turn = Eigen::Rotation2Dd(x > 0 ? angle : 0).toRotationMatrix();
    hold.targets.rightCols<2>() =
        ((hold.targets.rightCols<2>().rowwise() - centre) * turn.transpose()).rowwise() + centre;
    environment.holds.push_back(hold);
  }
  environment.holds.push_back(roller(bar,
                                     vertices_where(bar,
                                                    [&](const Vector3d& x) {
                                                      return x.x() == 0 &&
                                                             (x.tail<2>() - centre.transpose()).norm() < 1e-9;
                                                    }),
                                     0, 0));
  const StepReport report = settle(bar, environment, 1e-6);
  EXPECT_TRUE(report.converged);
  return 2 * report.solid / angle;
}

// Saint-Venant: T = 0.14058 G a^4 theta / L. Two meshes are refined to the limit.
TEST(Solids, ASquareBarIsTwisted) {
  const double side = 0.1, length = 0.2, E = 1e5, nu = 0.3, angle = 1e-3;
  const double expected = 0.14058 * E / (2 * (1 + nu)) * std::pow(side, 4) * angle / length;
  const double coarse = torque_of_bar(4, side, length, E, nu, angle),
               fine = torque_of_bar(8, side, length, E, nu, angle);
  EXPECT_GT(coarse, fine);  // a displacement method is too stiff
  EXPECT_NEAR(fine + (fine - coarse) / 3, expected, 0.01 * expected) << coarse << ' ' << fine;
}

/// A soft block on a slope; gravity is tilted.
Environment block_on_slope(const Sheet& block, double slope, double friction) {
  Environment environment = solid_environment(
      block, {.youngs_modulus = 3e4, .density = 300, .friction = friction, .stiffness_damping = 0.01});
  environment.obstacles.push_back({Plane{}});
  environment.gravity = 9.81 * Vector3d(std::sin(slope), 0, -std::cos(slope));
  return environment;
}

TEST(Solids, ABlockSticksOrSlidesOnASlopeAsItsFrictionSays) {
  const Sheet block = solid_box({0.1, 0.1, 0.05}, {3, 3, 2});
  const double slope = 0.2, weight = 300 * 0.1 * 0.1 * 0.05 * 9.81;
  const Eigen::VectorXd mass = 300 * block.vertex_volume;
  for (const double share : {0.9, 1.01}) {
    const double friction = share * std::tan(slope);
    Environment environment = block_on_slope(block, slope, friction);
    Solver solver(block, {.tolerance = 1e-6});
    StepReport report;
    const auto advance = [&](int steps) {
      for (int k = 0; k < steps; ++k) {
        report = solver.step(environment);
        EXPECT_TRUE(report.converged);
      }
      return Vector3d((mass.transpose() * environment.state.velocities).transpose() / mass.sum());
    };
    const Vector3d before = advance(50), after = advance(50);
    EXPECT_NEAR(report.obstacle_forces[0].z(), weight * std::cos(slope), 1e-4 * weight);
    const double acceleration = std::max(0.0, 9.81 * (std::sin(slope) - friction * std::cos(slope)));
    EXPECT_NEAR((after - before).x() / 0.5, acceleration, 1e-3) << share;
    if (share > 1) {
      EXPECT_LT(after.norm(), 1e-6);
    }
    EXPECT_LT(report.penetration_max, 1e-9);
  }
}

// A weight hung on the lower face of a bar: it grows by F L / (E A) in the mean, as under its own weight.
TEST(Solids, AHungWeightDrawsABar) {
  const double length = 0.2, side = 0.04, E = 1e6, force = 0.5;
  const Sheet bar = solid_box({side, side, length}, {2, 2, 5});
  Environment environment = solid_environment(bar, {.youngs_modulus = E, .poissons_ratio = 0, .density = 1});
  environment.gravity.setZero();
  environment.holds = {roller(bar, face_of(bar, 2, length), 2, length), roller(bar, face_of(bar, 0, 0), 0, 0),
                       roller(bar, face_of(bar, 1, 0), 1, 0)};
  const double face = side * side;
  for (const int i : face_of(bar, 2, 0)) {
    // The load of an even stress: by the area of the face's triangles at the vertex.
    double area = 0;
    for (Eigen::Index f = 0; f < bar.solid_surface.rows(); ++f) {
      const Points x = bar.rest.vertices(bar.solid_surface.row(f), Eigen::all);
      const bool own = (bar.solid_surface.row(f).array() == i).any() && x.col(2).maxCoeff() < 1e-9;
      const Vector3d a = x.row(1) - x.row(0), b = x.row(2) - x.row(0);
      if (own) area += a.cross(b).norm() / 6;
    }
    environment.loads.push_back({i, {0, 0, -force * area / face}});
  }
  EXPECT_TRUE(settle(bar, environment).converged);
  const double expected = force * length / (E * face),
               found = -mean_on_face(bar, environment.state.positions, 2, 0);
  EXPECT_NEAR(found, expected, 1e-3 * expected);  // strains are 3e-4
}

// A heavy weight fixed to the end of a light bar: a spring E A / L and a mass. Implicit Euler takes (omega
// h)^2 / 2 of the energy in a step, and makes the period longer by less than (omega h)^2; the bar's own mass
// adds a third of itself to the weight (Rayleigh).
TEST(Solids, AnAttachedWeightSwingsAsAMassOnASpring) {
  const double length = 0.2, side = 0.04, E = 1e6, mass = 2, density = 10, h = 1e-3;
  const Sheet bar = solid_box({side, side, length}, {1, 1, 4}, data::ElementOrder::quadratic);
  Environment environment =
      solid_environment(bar, {.youngs_modulus = E, .poissons_ratio = 0, .density = density});
  environment.gravity.setZero();
  environment.holds = {{.vertices = face_of(bar, 2, length)}};
  // As an even stress acts on a quadratic face: on the middle of its edges alone. The last triangle of four
  // of a face lies between these.
  for (Eigen::Index f = 3; f < bar.solid_surface.rows(); f += 4) {
    const Points x = bar.rest.vertices(bar.solid_surface.row(f), Eigen::all);
    if (x.col(2).maxCoeff() > 1e-9) continue;
    const Vector3d a = x.row(1) - x.row(0), b = x.row(2) - x.row(0);
    const double share = 4 * a.cross(b).norm() / 2 / (side * side) / 3;
    for (const int i : bar.solid_surface.row(f)) environment.point_masses.push_back({i, share * mass});
  }
  for (Eigen::Index i = 0; i < bar.rest.vertices.rows(); ++i)
    environment.state.velocities(i, 2) = -0.01 * (1 - bar.rest.vertices(i, 2) / length);
  Solver solver(bar, {.time_step = h, .tolerance = 1e-8});
  const auto height = [&] { return mean_on_face(bar, environment.state.positions, 2, 0); };
  double before = 0, now = 0;
  int step = 0;
  do {
    before = now;
    solver.step(environment);
    now = height();
    ++step;
  } while (step < 1000 && (step < 3 || now < 0));
  const double half = h * (step - 1 + before / (before - now)), own = density * side * side * length;
  const double omega = std::sqrt(E * side * side / length / (mass + own / 3)), expected = M_PI / omega;
  EXPECT_NEAR(half, expected, std::pow(omega * h, 2) * expected);
}

// The vertex within is pushed out through a face, so that tetrahedra are inside out: without stress from
// elsewhere the rest shape is where they end.
TEST(Solids, NeoHookeanTetrahedraThatAreInsideOutComeBack) {
  const Sheet block = solid_box({0.06, 0.06, 0.06}, {2, 2, 2});
  const std::vector<int> middle =
      vertices_where(block, [](const Vector3d& x) { return (x - Vector3d::Constant(0.03)).norm() < 1e-9; });
  ASSERT_EQ(middle.size(), 1u);
  for (const Constitutive model : {Constitutive::tet_neohookean, Constitutive::tet_neohookean_log})
    for (const double nu : {0.3, 0.45}) {
      Environment environment =
          solid_environment(block, {.constitutive = model, .youngs_modulus = 3e4, .poissons_ratio = nu});
      environment.gravity.setZero();
      environment.state.positions(middle[0], 2) += 0.045;
      ASSERT_GE(first_inverted(block, environment.state.positions), 0);
      const StepReport report = settle(block, environment);
      EXPECT_TRUE(report.converged);
      EXPECT_EQ(first_inverted(block, environment.state.positions), -1);
      EXPECT_LT(report.solid, 1e-12 * 3e4 * 0.06 * 0.06 * 0.06);
    }
}

std::vector<Environment> three_blocks(const Sheet& block) {
  std::vector<Environment> environments;
  for (const Constitutive model :
       {Constitutive::tet_corotated, Constitutive::tet_neohookean, Constitutive::tet_neohookean_log}) {
    environments.push_back(block_on_slope(block, 0.3, 0.2));
    environments.back().solids[0].constitutive = model;
    environments.back().state.positions.col(2).array() += 0.01;
  }
  return environments;
}

TEST(Solids, ABatchEqualsItsEnvironmentsAloneBitForBitOnAnyThreads) {
  const Sheet block = solid_box({0.06, 0.06, 0.06}, {2, 2, 2});
  const auto plan = make_sheet_plan(block);
  const std::vector<Environment> environments = three_blocks(block);
  Batch together(plan, environments, {.steps = 60, .threads = 3}), one(plan, environments, {.steps = 60});
  together.advance(60);
  for (const int steps : {7, 53}) one.advance(steps);
  for (int e = 0; e < 3; ++e) {
    Batch alone(make_sheet_plan(block), {environments[e]}, {.steps = 60});
    alone.advance(60);
    EXPECT_EQ(together.state(e).positions, alone.state(0).positions);
    EXPECT_EQ(together.state(e).velocities, alone.state(0).velocities);
    EXPECT_EQ(together.state(e).positions, one.state(e).positions);
    EXPECT_GT((alone.state(0).positions - environments[e].state.positions).norm(), 0.01);
    for (const StepStats& step : alone.stats(0)) EXPECT_TRUE(step.converged);
  }
}

TEST(Solids, ABatchGoesOnFromAState) {
  const Sheet block = solid_box({0.06, 0.06, 0.06}, {2, 2, 2});
  const auto plan = make_sheet_plan(block);
  const int steps = restart_interval + 20;
  Batch whole(plan, three_blocks(block), {.steps = steps}),
      before(plan, three_blocks(block), {.steps = restart_interval});
  whole.advance(steps);
  before.advance(restart_interval);
  std::vector<Environment> interrupted = three_blocks(block);
  for (int e = 0; e < 3; ++e) interrupted[e].state = before.state(e);
  Batch after(plan, interrupted, {.steps = steps, .first_step = restart_interval});
  after.advance(20);
  for (int e = 0; e < 3; ++e) EXPECT_EQ(after.state(e).positions, whole.state(e).positions);
}

TEST(Solids, WhatCannotBeIsRefusedByName) {
  const Sheet block = solid_box({0.06, 0.06, 0.06}, {1, 1, 1});
  const auto plan = make_sheet_plan(block);
  Environment environment = solid_environment(block, {});
  Batch batch(plan, {environment}, {.steps = 1, .device = Device::cuda});
  try {
    batch.advance(1);
    FAIL();
  } catch (const data::InputError& error) {
    EXPECT_STREQ(error.what(),
                 "--device cuda: solids (element_type TETRAHEDRON) are simulated on the CPU alone");
  }
  environment.solids.clear();
  EXPECT_THROW(Batch(plan, {environment}, {.steps = 1}), std::invalid_argument);
}

// A sheet and a solid in one environment step as each would alone: nothing joins them.
TEST(Solids, ASheetBesideASolidFallsAsAlone) {
  const Sheet block = solid_box({0.06, 0.06, 0.06}, {1, 1, 1});
  const Sheet cloth =
      make_sheet(data::rectangle({.width = 0.06, .height = 0.06, .cells_x = 2, .cells_y = 2}));
  const std::vector<Sheet> both = {cloth, block};
  const Sheet whole = joined(both);
  Environment environment;
  environment.materials = {{}, {}};
  environment.solids[1] = {};
  environment.state.positions = whole.rest.vertices;
  environment.state.velocities = Points::Zero(whole.rest.vertices.rows(), 3);
  Solver solver(whole, {.tolerance = 1e-9});
  for (int k = 0; k < 10; ++k) EXPECT_TRUE(solver.step(environment).converged);
  // Implicit Euler: g h^2 n (n + 1) / 2.
  const Points fallen = environment.state.positions - whole.rest.vertices;
  EXPECT_NEAR(fallen.col(2).maxCoeff(), -9.81 * 1e-4 * 55, 1e-6);
  EXPECT_NEAR(fallen.col(2).minCoeff(), -9.81 * 1e-4 * 55, 1e-6);
}

}  // namespace
}  // namespace flash::sim
