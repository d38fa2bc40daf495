#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using Eigen::Vector3d;

/// A sheet that meets the top of boxes, at z = 0, or their underside, and how.
struct Journey {
  std::string name;
  Vector3d start;  ///< of the sheet's corner, x from the seam [m]
  Vector3d velocity, gravity;
  double friction = 0.3, time_step = 0.005;
  int steps = 40;
  double higher = 0;  ///< the second box, than the first [m]
};

double solid_side(const Journey& journey) { return journey.name.starts_with("underside") ? 1 : -1; }

/// Where the sheet ends over one box, or over two that meet at x = 0 in its place.
data::Points end_of(const Journey& journey, const Sheet& sheet, bool two) {
  Environment environment = environment_of(sheet);
  environment.materials[0].friction = journey.friction;
  environment.gravity = journey.gravity;
  environment.state.positions.rowwise() += journey.start.transpose();
  environment.state.velocities.rowwise() = journey.velocity.transpose();
  const auto add_box = [&](double from, double to, double higher) {
    Box box{.half_extents = {0.5 * (to - from), 0.6, 0.05}};
    box.pose = Eigen::Translation3d(0.5 * (from + to), 0, solid_side(journey) * 0.05 + higher);
    environment.obstacles.push_back({box});
  };
  add_box(-0.6, two ? 0 : 0.6, 0);
  if (two) add_box(0, 0.6, journey.higher);
  Solver solver(sheet, {.time_step = journey.time_step, .tolerance = 1e-6});
  for (int n = 0; n < journey.steps; ++n) EXPECT_TRUE(solver.step(environment).converged) << journey.name;
  EXPECT_GT(environment.state.positions.col(0).maxCoeff(), 0.01) << journey.name << ": beyond the seam";
  EXPECT_LT((solid_side(journey) * environment.state.positions.col(2)).maxCoeff(), journey.higher + 1e-9)
      << journey.name;
  return environment.state.positions;
}

TEST(FlushBoxes, ASheetMeetsThemAsItMeetsOne) {
  const Sheet sheet = small_sheet(6, 0.06);
  const Vector3d down(0, 0, -9.81), none = Vector3d::Zero(), along(1, 0, 0);
  const double steep = 75 * M_PI / 180;
  const std::vector<Journey> journeys = {
      {"slides without friction", {-0.08, 0, 0}, along, down, 0},
      {"rubs", {-0.08, 0, 0}, along, down},
      {"slides down a steep slope",
       {-0.08, 0, 0},
       none,
       9.81 * Vector3d(std::sin(steep), 0, -std::cos(steep)),
       0.1},
      {"falls along a wall", {-0.08, 0, 0}, none, Vector3d(9.81, 0, 0)},
      {"slides without gravity", {-0.08, 0, 0}, along, none},
      {"is thrown without gravity", {-0.08, 0, 0.002}, Vector3d(1, 0, -0.3), none},
      {"underside, pressed up", {-0.08, 0, 0}, along, -down},
      {"lands at a slant", {-0.08, 0, 0.005}, along, down, 0.3, 0.001, 100},
      {"lands at a slant in long steps", {-0.08, 0, 0.005}, along, down, 0.3, 0.01, 20},
      {"drops with a row of vertices on the seam", {-0.03, 0, 0.05}, none, down, 0.3, 0.01, 30},
      {"second box higher by rounding", {-0.08, 0, 0}, along, down, 0.3, 0.005, 40, 2e-9},
  };
  for (const Journey& journey : journeys) {
    const data::Points one = end_of(journey, sheet, false), two = end_of(journey, sheet, true);
    // What forces out of balance by 1e-6 of the weight do in 0.2 s, twenty times over.
    EXPECT_LT((two - one).rowwise().norm().maxCoeff(), 4e-6) << journey.name;
  }
}

/// The leading edge comes to stand just before the seam.
TEST(FlushBoxes, AStepMayEndJustBeforeTheSeam) {
  const Sheet sheet = small_sheet(6, 0.06);
  Journey journey{"rubs", Vector3d::Zero(), Vector3d(1, 0, 0), Vector3d(0, 0, -9.81), 0.3, 0.005, 20};
  double slid = 0;  // in four steps
  for (int n = 1; n <= 4; ++n)
    slid += journey.time_step * (journey.velocity.x() - n * journey.time_step * journey.friction * 9.81);
  for (const double before_seam : {1e-3, 1e-5, 3e-6, 1e-6, 1e-8, 1e-9}) {
    journey.start.x() = -sheet.rest.vertices.col(0).maxCoeff() - slid - before_seam;
    const data::Points one = end_of(journey, sheet, false), two = end_of(journey, sheet, true);
    EXPECT_LT((two - one).rowwise().norm().maxCoeff(), 1e-6) << before_seam;
  }
}

/// A vertex that a higher box stops at the seam does not fall between the two.
TEST(FlushBoxes, ASheetThatCatchesAtAStepStaysOnTop) {
  const Sheet sheet = small_sheet(6, 0.06);
  for (const double step : {1e-5, 1e-4, 1e-3}) {
    Environment environment = environment_of(sheet);
    environment.materials[0].friction = 0;
    environment.state.positions.col(0).array() -= 0.065;
    environment.state.velocities.col(0).setConstant(0.1);
    for (const double side : {-1.0, 1.0}) {
      Box box{.half_extents = {0.3, 0.3, 0.05}};
      box.pose = Eigen::Translation3d(0.3 * side, 0, -0.05 + (side > 0 ? step : 0));
      environment.obstacles.push_back({box});
    }
    Solver solver(sheet, {.time_step = 0.005});
    for (int n = 0; n < 100; ++n) {
      EXPECT_TRUE(solver.step(environment).converged) << step;
      EXPECT_GT(environment.state.positions.col(2).minCoeff(), -1e-9) << step;
    }
  }
}

Obstacle box_between(const Vector3d& low, const Vector3d& high) {
  Box box{.half_extents = 0.5 * (high - low)};
  box.pose = Eigen::Translation3d(0.5 * (low + high));
  return {box};
}

/// A sheet that lies on a table at z = 0, under or beside what else is there, stays where it is.
TEST(FlushBoxes, ASheetAtRestStaysOnItsTable) {
  const Sheet sheet = small_sheet(6, 0.2);
  const Obstacle table = box_between({-0.5, -0.5, -0.1}, {0.5, 0.5, 0});
  const std::vector<std::vector<Obstacle>> scenes = {
      // A board pierces the table: what starts in the board leaves it, and nothing else moves.
      {table, box_between({0.08, -0.5, -0.25e-3}, {0.13, 0.5, 0.5e-3})},
      // Two blocks that overlap stand on it; a vertex lies at the edge of one, under the other.
      {table, box_between({0.04, 0.04, 0}, {0.12, 0.1, 0.06}),
       box_between({0.08, 0.02, 0}, {0.16, 0.14, 0.05})},
      // A box in a plane stands proud of it by half a micrometre.
      {{Plane{}}, box_between({0.05, 0.05, -0.1}, {0.13, 0.13, 0.5e-6})},
  };
  for (std::size_t k = 0; k < scenes.size(); ++k)
    for (const double h : {0.005, 0.01}) {
      Environment environment = environment_of(sheet);
      environment.obstacles = scenes[k];
      Solver solver(sheet, {.time_step = h});
      for (int n = 0; n < 20; ++n) EXPECT_TRUE(solver.step(environment).converged) << k << " step " << n;
      const auto z = environment.state.positions.col(2);
      EXPECT_GT(z.minCoeff(), -1e-9) << k;
      EXPECT_LT(z.maxCoeff(), 2e-3) << k;
    }
}

}  // namespace
}  // namespace flash::sim
