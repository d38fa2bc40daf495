#include "sim/scene/bending_excess.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "data/mesh/procedural_mesh.h"
#include "sim/newton/solver.h"
#include "sim/scene/solid.h"

namespace flash::sim {
namespace {

constexpr double nu = 0.3;

/// A beam five times as long as thick.
data::TetMesh beam(int cells) { return data::tet_box({0.5, 0.1, 0.1}, {5 * cells, cells, cells}); }

double excess(const data::TetMesh& mesh, double poissons_ratio = nu,
              data::Constitutive constitutive = data::Constitutive::tet_neohookean,
              data::ElementOrder order = data::ElementOrder::linear) {
  const Sheet sheet = make_solid(mesh, {}, order);
  return bending_excess(sheet, sheet.bodies[0], constitutive, poissons_ratio);
}

/// How far the end of a clamped beam goes down under a small weight of its own, in the mean [m].
double sag(int cells, data::ElementOrder order) {
  const Sheet sheet = make_solid(beam(cells), {}, order);
  Environment environment;
  environment.solids[0] = {.youngs_modulus = 1e6, .poissons_ratio = nu, .density = 10};
  environment.gravity = {0, 0, -9.81};
  environment.state.positions = sheet.rest.vertices;
  environment.state.velocities = data::Points::Zero(sheet.rest.vertices.rows(), 3);
  std::vector<int> clamped, end;
  for (int i = 0; i < static_cast<int>(sheet.rest.vertices.rows()); ++i) {
    if (sheet.rest.vertices(i, 0) < 1e-9) clamped.push_back(i);
    if (sheet.rest.vertices(i, 0) > 0.5 - 1e-9) end.push_back(i);
  }
  environment.holds = {{.vertices = clamped}};
  Solver solver(sheet, {.time_step = 1.0, .tolerance = 1e-5});
  for (int step = 0; step < 4; ++step) {
    EXPECT_TRUE(solver.step(environment).converged);
    environment.state.velocities.setZero();
  }
  double sum = 0;
  for (const int i : end) sum += sheet.rest.vertices(i, 2) - environment.state.positions(i, 2);
  return sum / static_cast<double>(end.size());
}

// The energy of the interpolant bounds what a cantilever misses, from above and closely: most of its sag is
// bending, and near its clamp the beam is free in less than the exact solution.
TEST(BendingExcess, BoundsWhatACantileverMisses) {
  for (const int cells : {2, 4}) {
    const double missed =
        sag(cells, data::ElementOrder::quadratic) / sag(cells, data::ElementOrder::linear) - 1;
    const double bound = excess(beam(cells));
    EXPECT_LT(missed, bound) << cells;
    EXPECT_GT(missed, 0.7 * bound) << cells;
  }
}

// A strain that is linear in space is met by constant ones to the square of the cell.
TEST(BendingExcess, FallsWithTheSquareOfTheCell) {
  EXPECT_NEAR(excess(beam(2)) / excess(beam(4)), 4, 1e-9);
  EXPECT_NEAR(excess(beam(4)) / excess(beam(8)), 4, 1e-9);
}

TEST(BendingExcess, KnowsNeitherSizeNorPlace) {
  data::TetMesh mesh = data::tet_box({0.5, 0.1, 0.05}, {20, 4, 2});
  const double as_it_is = excess(mesh);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  mesh.vertices = (7 * mesh.vertices * turn.transpose()).rowwise() + Eigen::RowVector3d(5, -3, 2);
  EXPECT_NEAR(excess(mesh), as_it_is, 1e-6 * as_it_is);
}

TEST(BendingExcess, GrowsTowardsNuOfAHalfAndIsNoneOfQuadraticElements) {
  EXPECT_GT(excess(beam(4), 0.49), 2 * excess(beam(4), 0.3));
  EXPECT_EQ(excess(beam(2), 0.49, data::Constitutive::tet_neohookean, data::ElementOrder::quadratic), 0);
  EXPECT_EQ(excess(beam(4), 0.49, data::Constitutive::tet_arap), excess(beam(4), 0));
}

TEST(BendingExcess, SlendernessIsThatOfABox) {
  const Sheet sheet = make_solid(data::tet_box({0.1, 0.5, 0.2}, {2, 10, 4}));
  EXPECT_NEAR(slenderness(sheet, sheet.bodies[0]), 5, 1e-6);
}

}  // namespace
}  // namespace flash::sim
