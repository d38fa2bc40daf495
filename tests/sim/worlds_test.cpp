#include "sim/worlds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "data/files/error.h"
#include "data/motion/trajectory.h"
#include "sim/batch.h"
#include "tests/sim/sheet_scene.h"
#include "tests/sim/worlds_scene.h"

namespace flash::sim {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double h = worlds_time_step;

/// Tests that hold wherever the worlds are.
class WorldsOn : public testing::TestWithParam<Device> {
 protected:
  void SetUp() override {
    if (GetParam() == Device::cuda && !why_no_cuda().empty()) GTEST_SKIP() << why_no_cuda();
  }
  static WorldSettings here(WorldSettings settings = {}) {
    settings.device = GetParam();
    return settings;
  }
};
INSTANTIATE_TEST_SUITE_P(Devices, WorldsOn, testing::Values(Device::cpu, Device::cuda),
                         [](const auto& device) { return device.param == Device::cpu ? "cpu" : "cuda"; });

/// Gives the poses for the step that follows the `k`-th to environments and takes it.
void drive(Worlds& worlds, const std::vector<int>& environments, int k) {
  const Eigen::Matrix<double, 7, 1> pose = pose_numbers(k + 1);
  std::vector<double> numbers;
  for (std::size_t e = 0; e < environments.size(); ++e)
    numbers.insert(numbers.end(), pose.begin(), pose.end());
  worlds.set_poses(environments, 0, tensor(numbers, {std::ssize(environments), 7}));
  worlds.step();
}

// The batch reads a schedule; the worlds are told. Few iterations send steps into halves, whose poses lie
// between those.
TEST_P(WorldsOn, PosesGivenStepByStepAreThoseOfASchedule) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  const int steps = 120;
  for (const int iterations : {60, 3}) {
    const SolverSettings solver = {.max_iterations = iterations};
    Batch batch(plan, {planned(on_a_table(sheet), steps), planned(on_a_table(sheet, 1000), steps)},
                {.solver = solver, .steps = steps, .device = GetParam()});
    batch.advance(steps);
    Worlds worlds(plan, {on_a_table(sheet), on_a_table(sheet, 1000)}, here({.solver = solver}));
    for (int k = 0; k < steps; ++k) drive(worlds, {0, 1}, k);
    int parts = 0;
    for (int e = 0; e < 2; ++e) {
      expect_same(batch.state(e), state(worlds, e));
      for (const StepStats& step : batch.stats(e)) parts = std::max(parts, step.substeps);
      EXPECT_EQ(worlds.status(e).residual, batch.stats(e).back().residual);
    }
    if (iterations == 3) {
      EXPECT_GT(parts, 1);  // or nothing was seen of halves
    }
  }
}

TEST_P(WorldsOn, GraspsFromOutsideAreThoseOfTimes) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  const int steps = 60, closes = 10, opens = 40;
  Environment timed = planned(on_a_table(sheet), steps);
  timed.holds[0].to = closes * h;
  timed.holds[1].from = closes * h;
  timed.holds[1].to = opens * h;
  Batch batch(plan, {timed}, {.steps = steps, .device = GetParam()});
  batch.advance(steps);
  Worlds worlds(plan, {planned(on_a_table(sheet), steps)}, here());
  std::size_t taken = 0;
  for (int k = 0; k < steps; ++k) {
    if (k == closes) worlds.release({}, 0);
    if (k >= closes && k < opens) worlds.grasp({}, 1);  // once more changes nothing
    if (k == opens) worlds.release({}, 1);
    worlds.step();
    taken = std::max(taken, state(worlds, 0).held[1].vertices.size());
  }
  EXPECT_GT(taken, 1u);
  EXPECT_TRUE(state(worlds, 0).held[1].vertices.empty());
  expect_same(batch.state(0), state(worlds, 0));
}

TEST_P(WorldsOn, AGraspMayNameVertices) {
  const Sheet sheet = small_sheet();
  Worlds worlds(make_sheet_plan(sheet), {on_a_table(sheet), on_a_table(sheet)}, here());
  worlds.grasp(std::vector{1}, 1, {.vertices = {17, 9}});
  worlds.step();
  EXPECT_TRUE(state(worlds, 0).held[1].vertices.empty());
  EXPECT_EQ(state(worlds, 1).held[1].vertices, (std::vector<int>{17, 9}));
}

// x_n = -g h^2 n (n + 1) / 2 by implicit Euler. The tolerance leaves as large a share of each step's h^2 g.
TEST_P(WorldsOn, WhatFallsObeysTheDiscreteLaw) {
  const Sheet sheet = small_sheet();
  const std::vector<double> gravity = {9.81, 1.62, 3.7};
  std::vector<Environment> environments;
  for (const double g : gravity) {
    environments.push_back(environment_of(sheet));
    environments.back().gravity = {0, 0, -g};
  }
  const double tolerance = 1e-9;
  Worlds worlds(make_sheet_plan(sheet), environments,
                here({.solver = {.tolerance = tolerance}, .threads = 2}));
  worlds.step(40);
  worlds.reset(std::vector{1});
  worlds.step(60);
  for (int e = 0; e < 3; ++e) {
    const double n = e == 1 ? 60 : 100, step = h * h * gravity[static_cast<std::size_t>(e)];
    EXPECT_EQ(worlds.status(e).steps, n);
    const auto fallen = state(worlds, e).positions.col(2);
    // A sheet's norm of the residual may lie on one vertex: the root of their number.
    const double allowed = n * n * step * tolerance * std::sqrt(double(fallen.size())) + 1e-14;
    EXPECT_LT((fallen.array() + step * n * (n + 1) / 2).abs().maxCoeff(), allowed) << e;
  }
}

// m g on the table, from the mass alone.
TEST(Worlds, ViewsShowTheEndOfTheLastStep) {
  const Sheet sheet = small_sheet();
  std::vector<Environment> environments(3, on_a_table(sheet));
  for (Environment& environment : environments) {
    environment.holds[0].from = std::numeric_limits<double>::infinity();
    environment.obstacles[1].frame = base_frame;
    environment.obstacles[1].shape =
        Box{.half_extents = Vector3d::Constant(0.01), .pose = Isometry3d(Eigen::Translation3d(0, 0, -1))};
  }
  environments[1].materials[0].areal_density = 0.4;
  Worlds worlds(make_sheet_plan(sheet), environments, {});
  const Tensor x = worlds.positions(), v = worlds.velocities(), forces = worlds.obstacle_forces(),
               status = worlds.status();
  worlds.step(3);
  worlds.step();
  EXPECT_EQ(worlds.positions().data, x.data);
  EXPECT_EQ(x.shape, (std::vector<std::int64_t>{3, sheet.rest.vertices.rows(), 3}));
  EXPECT_EQ(worlds.hold_forces().shape, (std::vector<std::int64_t>{3, 2, 3}));
  EXPECT_EQ(forces.shape, (std::vector<std::int64_t>{3, 2, 3}));
  EXPECT_EQ(status.shape, (std::vector<std::int64_t>{3, 7}));
  EXPECT_EQ(x.device, Device::cpu);
  for (int e = 0; e < 3; ++e) {
    const std::ptrdiff_t first = 3 * e * sheet.rest.vertices.rows();
    const auto rows = [&](const Tensor& tensor) {
      return Eigen::Map<const data::Points>(static_cast<const double*>(tensor.data) + first,
                                            sheet.rest.vertices.rows(), 3);
    };
    EXPECT_EQ(rows(x), state(worlds, e).positions);
    EXPECT_EQ(rows(v), state(worlds, e).velocities);
    const double weight = worlds.environment(e).materials[0].areal_density * 0.12 * 0.12 * 9.81;
    const double* force = static_cast<const double*>(forces.data) + 6 * e;
    EXPECT_NEAR(force[2], weight, 1e-3 * weight);  // the tolerance on the residual
    EXPECT_EQ(force[5], 0);
    EXPECT_EQ(static_cast<const double*>(status.data)[7 * e], 4);
    EXPECT_EQ(worlds.status(e).converged, 1);
  }
}

TEST_P(WorldsOn, AResetIsANewStartBitForBit) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  Worlds worlds(plan, {on_a_table(sheet), on_a_table(sheet, 1000)}, here()),
      undisturbed(plan, {on_a_table(sheet)}, here());
  for (int k = 0; k < 20; ++k) {
    drive(undisturbed, {0}, k);
    drive(worlds, {0, 1}, k);
    if (k == 5) worlds.grasp(std::vector{1}, 1);
  }
  data::SheetMaterial stiff = worlds.environment(1).materials[0];
  stiff.membrane_stiffness = 300;
  worlds.set_materials(std::vector{1}, std::vector{stiff});
  worlds.reset(std::vector{1});
  Worlds fresh(plan, {on_a_table(sheet, 300)}, here());
  expect_same(state(worlds, 1), state(fresh, 0));
  for (int k = 0; k < 60; ++k) {
    drive(fresh, {0}, k);
    drive(worlds, {1}, k);
  }
  expect_same(state(worlds, 1), state(fresh, 0));
  undisturbed.step(60);  // what is given no pose stays
  expect_same(state(worlds, 0), state(undisturbed, 0));

  // From other places, with nothing held of what was.
  const data::Points raised = sheet.rest.vertices.rowwise() + Eigen::RowVector3d(0, 0, 0.2);
  const std::vector<double> numbers(raised.data(), raised.data() + raised.size());
  worlds.reset(std::vector{0}, tensor(numbers, {1, raised.rows(), 3}));
  Environment start = on_a_table(sheet);
  start.state.positions = raised;
  Worlds from_there(plan, {start}, here());
  worlds.step(20);
  from_there.step(20);
  expect_same(state(worlds, 0), state(from_there, 0));
}

/// On a table, with layers that meet: an edge of the sheet is carried over to the other.
Environment folded(const Sheet& sheet) {
  Environment environment = environment_of(sheet);
  environment.obstacles.push_back({Plane{.point = {0, 0, -1e-6}}});
  environment.self_contact = SelfContact{.thickness = 1e-3};
  data::Trajectory over;
  for (int k = 0; k <= 10; ++k) {
    const double angle = std::numbers::pi * k / 10;
    over.times.push_back(0.05 * k);
    over.poses.push_back(
        Isometry3d(Eigen::Translation3d(0.06 - 0.055 * std::cos(angle), 0, 0.004 + 0.05 * std::sin(angle))));
  }
  std::vector<int> edge;
  for (int i = 0; i < sheet.rest.vertices.rows(); ++i)
    if (sheet.rest.vertices(i, 0) < 1e-9) edge.push_back(i);
  environment.holds = {gripped(environment, edge, over)};
  return environment;
}

TEST_P(WorldsOn, WhatIsSavedAndLoadedGoesOnBitForBit) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  const auto drive_to = [&](Worlds& worlds, const std::vector<int>& environments, int from, int to) {
    for (int k = from; k < to; ++k) drive(worlds, environments, k);
  };
  // Not where solvers forget, so that they have to be saved with what they hold.
  Worlds whole(plan, {on_a_table(sheet), on_a_table(sheet, 1000)}, here());
  drive_to(whole, {0, 1}, 0, 37);
  const Checkpoint checkpoint = whole.save(std::vector{1});
  drive_to(whole, {0, 1}, 37, 90);
  Worlds other(plan, {on_a_table(sheet), on_a_table(sheet, 30), on_a_table(sheet)}, here({.threads = 2}));
  other.step(5);
  other.load(std::vector{2}, checkpoint);
  EXPECT_EQ(other.status(2).steps, 37);
  drive_to(other, {2}, 37, 90);
  expect_same(state(other, 2), state(whole, 1));
  // From one checkpoint as often as one likes.
  other.load(std::vector{0}, checkpoint);
  drive_to(other, {0}, 37, 90);
  expect_same(state(other, 0), state(whole, 1));
}

TEST(Worlds, LayersThatAreSavedAndLoadedGoOnBitForBit) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  Worlds layers(plan, {folded(sheet)}, {});
  layers.step(53);
  const Checkpoint folding = layers.save({});
  layers.step(20);
  EXPECT_GT(layers.report(0).layer_touches, 0);
  Worlds later(plan, {folded(sheet)}, {});
  later.load({}, folding);
  later.step(20);
  expect_same(state(later, 0), state(layers, 0));
}

TEST(Worlds, MaterialsHoldFromTheNextStepOn) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  const Environment start = planned(on_a_table(sheet), 30);
  Worlds worlds(plan, {start, start}, {});
  // The oracle is one solver, whose environment is changed by hand.
  Environment alone = start;
  Solver solver(plan, {});
  for (int k = 0; k < 30; ++k) {
    if (k == 10) {
      data::SheetMaterial other = alone.materials[0];
      other.bending_rigidity = 1e-4;
      other.friction = 0.7;
      worlds.set_materials(std::vector{1}, std::vector{other});
      alone.materials[0] = other;
    }
    worlds.step();
    solver.step(alone);
  }
  expect_same(state(worlds, 1), alone.state);
  EXPECT_FALSE(state(worlds, 0).positions == alone.state.positions);
}

TEST_P(WorldsOn, AnEnvironmentThatIsLostSaysWhyAndTheOthersGoOn) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  std::vector<Environment> environments(4, on_a_table(sheet));
  const bool has_layers = GetParam() == Device::cpu;
  if (has_layers) environments[3].self_contact = SelfContact{.thickness = 1};  // thicker than a cell
  Worlds worlds(plan, environments, here({.threads = 2})), alone(plan, {on_a_table(sheet)}, here());
  const Reach far_away = {
      .object = "towel", .first_vertex = 40, .half_extents = Vector3d::Zero(), .threshold = 1e-6};
  for (int k = 0; k < 10; ++k) drive(worlds, {0, 1, 2}, k);
  worlds.grasp(std::vector{0}, 1, {.reach = far_away});
  std::vector<double> speeds(static_cast<std::size_t>(3 * plan->pattern.size), 1e308);
  worlds.set_velocities(std::vector{2}, tensor(speeds, {1, plan->pattern.size, 3}));
  const data::Points before = state(worlds, 0).positions;
  for (int k = 10; k < 30; ++k) drive(worlds, {0, 1, 2}, k);
  for (int k = 0; k < 30; ++k) drive(alone, {0}, k);
  EXPECT_EQ(worlds.status(0).lost, double(Lost::no_vertex_in_reach));
  EXPECT_NE(worlds.why_lost(0).find("no vertex of towel within 1e-06 m"), std::string::npos);
  EXPECT_EQ(worlds.status(0).steps, 10);
  EXPECT_EQ(state(worlds, 0).positions, before);
  EXPECT_EQ(worlds.status(0).converged, 0);
  EXPECT_EQ(worlds.status(2).lost, double(Lost::not_finite));
  if (has_layers) {
    EXPECT_EQ(worlds.status(3).lost, double(Lost::refused));
    EXPECT_NE(worlds.why_lost(3).find("self_contact"), std::string::npos);
  }
  EXPECT_EQ(worlds.status(1).lost, double(Lost::no));
  EXPECT_EQ(worlds.why_lost(1), "");
  expect_same(state(worlds, 1), state(alone, 0));
  worlds.reset(std::vector{0});
  EXPECT_EQ(worlds.why_lost(0), "");
  for (int k = 0; k < 30; ++k) drive(worlds, {0}, k);
  expect_same(state(worlds, 0), state(alone, 0));

  Worlds strict(plan, {on_a_table(sheet)}, here({.lost_residual = 0}));
  strict.step(2);
  EXPECT_EQ(strict.status(0).lost, double(Lost::not_solved));
  EXPECT_EQ(strict.status(0).steps, 1);
}

TEST_P(WorldsOn, AGraspThatMayMissLosesNothing) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  Worlds worlds(plan, {on_a_table(sheet)}, here()), alone(plan, {on_a_table(sheet)}, here());
  const Reach far_away = {.first_vertex = 40, .half_extents = Vector3d::Zero(), .threshold = 1e-6};
  for (int k = 0; k < 10; ++k) {
    worlds.grasp({}, 1, {.reach = far_away, .may_miss = true});
    drive(worlds, {0}, k);
    drive(alone, {0}, k);
  }
  EXPECT_EQ(worlds.why_lost(0), "");
  expect_same(state(worlds, 0), state(alone, 0));
}

TEST_P(WorldsOn, NeitherThreadsNorPartsNorNeighboursChangeAnything) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  const int steps = 60;
  const auto world = [&](double stiffness) { return planned(on_a_table(sheet, stiffness), steps); };
  Worlds together(plan, {world(30), world(100), world(300)}, here({.threads = 3}));
  std::vector<int> seen(3, 0);
  together.step(steps, [&](int e) { ++seen[static_cast<std::size_t>(e)]; });
  EXPECT_EQ(seen, std::vector<int>(3, steps));
  Worlds parts(plan, {world(300), world(30)}, here());
  for (const int count : {1, 0, 7, 52}) parts.step(count);
  expect_same(state(together, 2), state(parts, 0));
  expect_same(state(together, 0), state(parts, 1));
}

// Which are done is often nobody.
TEST_P(WorldsOn, AListWithoutANumberMeansNone) {
  const Sheet sheet = small_sheet();
  Worlds worlds(make_sheet_plan(sheet), {on_a_table(sheet), on_a_table(sheet)}, here());
  worlds.step(3);
  const std::vector<int> none;
  worlds.reset(none);
  worlds.set_poses(none, 0, {.shape = {0, 7}});
  worlds.release(none, 0);
  EXPECT_EQ(worlds.save(none).size(), 0);
  worlds.load(none, worlds.save(none));
  EXPECT_EQ(worlds.status(0).steps, 3);
  worlds.reset({});
  EXPECT_EQ(worlds.status(0).steps, 0);
  EXPECT_EQ(worlds.status(1).steps, 0);
}

}  // namespace
}  // namespace flash::sim
