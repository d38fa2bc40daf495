#include "sim/worlds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "data/error.h"
#include "data/trajectory.h"
#include "sim/batch.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double h = 0.01;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// The k-th pose of a gripper that lifts, carries and turns; through the numbers that a setter takes.
Eigen::Matrix<double, 7, 1> pose_numbers(int k) {
  const double t = h * k;
  const Isometry3d pose = Eigen::Translation3d(0.3 * t, 0.1 * t * t, 0.5 * t * (1 - t)) *
                          Eigen::AngleAxisd(2 * t, Vector3d(1, 2, 3).normalized());
  return data::to_vector(pose);
}

/// A sheet on a table, whose gripper stands at a corner at the start: a hold that takes what is near, and one
/// that is open until it is asked to close. A peg goes with the gripper.
Environment on_a_table(const Sheet& sheet, double stiffness = 100) {
  Environment environment = environment_of(sheet);
  environment.materials[0].membrane_stiffness = stiffness;
  environment.obstacles.push_back({Plane{}});
  environment.obstacles.push_back(
      {Box{.half_extents = {0.01, 0.01, 0.01}, .pose = Isometry3d(Eigen::Translation3d(-0.03, 0, 0.05))}});
  environment.obstacles.back().frame = 0;
  environment.holds = {
      {.name = "corner", .vertices = {0, 1}, .frame = 0},
      {.name = "gripper",
       .frame = 0,
       .from = std::numeric_limits<double>::infinity(),
       .reach = Reach{.object = "towel", .half_extents = Vector3d::Constant(0.03), .threshold = 0.005}}};
  environment.schedule = std::make_shared<const Schedule>(
      Schedule{.start = 0, .time_step = h, .frames = {{data::from_vector(pose_numbers(0))}}});
  return environment;
}

/// The same with the poses of `steps` steps planned.
Environment planned(Environment environment, int steps) {
  Schedule schedule = *environment.schedule;
  for (int k = 1; k <= steps; ++k) schedule.frames[0].push_back(data::from_vector(pose_numbers(k)));
  environment.schedule = std::make_shared<const Schedule>(schedule);
  return environment;
}

Tensor tensor(const std::vector<double>& numbers, std::vector<std::int64_t> shape) {
  return {.data = numbers.data(), .shape = std::move(shape)};
}

/// Gives the poses for the step that follows the `k`-th to environments and takes it.
void drive(Worlds& worlds, const std::vector<int>& environments, int k) {
  const Eigen::Matrix<double, 7, 1> pose = pose_numbers(k + 1);
  std::vector<double> numbers;
  for (std::size_t e = 0; e < environments.size(); ++e)
    numbers.insert(numbers.end(), pose.begin(), pose.end());
  worlds.set_poses(environments, 0, tensor(numbers, {std::ssize(environments), 7}));
  worlds.step();
}

/// Equal in every bit.
void expect_same(const State& a, const State& b) {
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.velocities, b.velocities);
  EXPECT_EQ(a.bristles, b.bristles);
  EXPECT_EQ(a.time, b.time);
  EXPECT_TRUE(std::ranges::equal(a.pair_bristles, b.pair_bristles, [](const auto& p, const auto& q) {
    return p.vertices == q.vertices && p.edges == q.edges && p.share == q.share;
  }));
}

const State& state(const Worlds& worlds, int e) { return worlds.environment(e).state; }

// The batch reads a schedule; the worlds are told. Few iterations send steps into halves, whose poses lie
// between those.
TEST(Worlds, PosesGivenStepByStepAreThoseOfASchedule) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  const int steps = 120;
  for (const int iterations : {60, 3}) {
    const SolverSettings solver = {.max_iterations = iterations};
    Batch batch(plan, {planned(on_a_table(sheet), steps), planned(on_a_table(sheet, 1000), steps)},
                {.solver = solver, .steps = steps});
    batch.advance(steps);
    Worlds worlds(plan, {on_a_table(sheet), on_a_table(sheet, 1000)}, {.solver = solver});
    for (int k = 0; k < steps; ++k) drive(worlds, {0, 1}, k);
    int parts = 0;
    for (int e = 0; e < 2; ++e) {
      expect_same(batch.state(e), state(worlds, e));
      for (const StepStats& step : batch.stats(e)) parts = std::max(parts, step.substeps);
      EXPECT_EQ(worlds.status(e).residual, batch.stats(e).back().residual);
    }
    EXPECT_EQ(parts > 1, iterations == 3);
  }
}

TEST(Worlds, GraspsFromOutsideAreThoseOfTimes) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  const int steps = 60, closes = 10, opens = 40;
  Environment timed = planned(on_a_table(sheet), steps);
  timed.holds[0].to = closes * h;
  timed.holds[1].from = closes * h;
  timed.holds[1].to = opens * h;
  Batch batch(plan, {timed}, {.steps = steps});
  batch.advance(steps);
  Worlds worlds(plan, {planned(on_a_table(sheet), steps)}, {});
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

TEST(Worlds, AGraspMayNameVertices) {
  const Sheet sheet = small_sheet();
  Worlds worlds(make_sheet_plan(sheet), {on_a_table(sheet), on_a_table(sheet)}, {});
  worlds.grasp(std::vector{1}, 1, {.vertices = {17, 9}});
  worlds.step();
  EXPECT_TRUE(state(worlds, 0).held[1].vertices.empty());
  EXPECT_EQ(state(worlds, 1).held[1].vertices, (std::vector<int>{17, 9}));
}

// x_n = -g h^2 n (n + 1) / 2 by implicit Euler. The tolerance leaves as large a share of each step's h^2 g.
TEST(Worlds, WhatFallsObeysTheDiscreteLaw) {
  const Sheet sheet = small_sheet();
  const std::vector<double> gravity = {9.81, 1.62, 3.7};
  std::vector<Environment> environments;
  for (const double g : gravity) {
    environments.push_back(environment_of(sheet));
    environments.back().gravity = {0, 0, -g};
  }
  const double tolerance = 1e-9;
  Worlds worlds(make_sheet_plan(sheet), environments, {.solver = {.tolerance = tolerance}, .threads = 2});
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

TEST(Worlds, AResetIsANewStartBitForBit) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  Worlds worlds(plan, {on_a_table(sheet), on_a_table(sheet, 1000)}, {}),
      undisturbed(plan, {on_a_table(sheet)}, {});
  for (int k = 0; k < 20; ++k) {
    drive(undisturbed, {0}, k);
    drive(worlds, {0, 1}, k);
    if (k == 5) worlds.grasp(std::vector{1}, 1);
  }
  data::SheetMaterial stiff = worlds.environment(1).materials[0];
  stiff.membrane_stiffness = 300;
  worlds.set_materials(std::vector{1}, std::vector{stiff});
  worlds.reset(std::vector{1});
  Worlds fresh(plan, {on_a_table(sheet, 300)}, {});
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
  Worlds from_there(plan, {start}, {});
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

TEST(Worlds, WhatIsSavedAndLoadedGoesOnBitForBit) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  const auto drive_to = [&](Worlds& worlds, const std::vector<int>& environments, int from, int to) {
    for (int k = from; k < to; ++k) drive(worlds, environments, k);
  };
  // Not where solvers forget, so that they have to be saved with what they hold.
  Worlds whole(plan, {on_a_table(sheet), on_a_table(sheet, 1000)}, {});
  drive_to(whole, {0, 1}, 0, 37);
  const Checkpoint checkpoint = whole.save(std::vector{1});
  drive_to(whole, {0, 1}, 37, 90);
  Worlds other(plan, {on_a_table(sheet), on_a_table(sheet, 30), on_a_table(sheet)}, {.threads = 2});
  other.step(5);
  other.load(std::vector{2}, checkpoint);
  EXPECT_EQ(other.status(2).steps, 37);
  drive_to(other, {2}, 37, 90);
  expect_same(state(other, 2), state(whole, 1));
  // From one checkpoint as often as one likes.
  other.load(std::vector{0}, checkpoint);
  drive_to(other, {0}, 37, 90);
  expect_same(state(other, 0), state(whole, 1));

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

TEST(Worlds, AnEnvironmentThatIsLostSaysWhyAndTheOthersGoOn) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  std::vector<Environment> environments(4, on_a_table(sheet));
  environments[3].self_contact = SelfContact{.thickness = 1};  // thicker than a cell
  Worlds worlds(plan, environments, {.threads = 2}), alone(plan, {on_a_table(sheet)}, {});
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
  EXPECT_EQ(worlds.status(3).lost, double(Lost::refused));
  EXPECT_NE(worlds.why_lost(3).find("self_contact"), std::string::npos);
  EXPECT_EQ(worlds.status(1).lost, double(Lost::no));
  EXPECT_EQ(worlds.why_lost(1), "");
  expect_same(state(worlds, 1), state(alone, 0));
  worlds.reset(std::vector{0});
  EXPECT_EQ(worlds.why_lost(0), "");
  for (int k = 0; k < 30; ++k) drive(worlds, {0}, k);
  expect_same(state(worlds, 0), state(alone, 0));

  Worlds strict(plan, {on_a_table(sheet)}, {.lost_residual = 0});
  strict.step(2);
  EXPECT_EQ(strict.status(0).lost, double(Lost::not_solved));
  EXPECT_EQ(strict.status(0).steps, 1);
}

TEST(Worlds, AGraspThatMayMissLosesNothing) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  Worlds worlds(plan, {on_a_table(sheet)}, {}), alone(plan, {on_a_table(sheet)}, {});
  const Reach far_away = {.first_vertex = 40, .half_extents = Vector3d::Zero(), .threshold = 1e-6};
  for (int k = 0; k < 10; ++k) {
    worlds.grasp({}, 1, {.reach = far_away, .may_miss = true});
    drive(worlds, {0}, k);
    drive(alone, {0}, k);
  }
  EXPECT_EQ(worlds.why_lost(0), "");
  expect_same(state(worlds, 0), state(alone, 0));
}

TEST(Worlds, NeitherThreadsNorPartsNorNeighboursChangeAnything) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  const int steps = 60;
  const auto world = [&](double stiffness) { return planned(on_a_table(sheet, stiffness), steps); };
  Worlds together(plan, {world(30), world(100), world(300)}, {.threads = 3});
  std::vector<int> seen(3, 0);
  together.step(steps, [&](int e) { ++seen[static_cast<std::size_t>(e)]; });
  EXPECT_EQ(seen, std::vector<int>(3, steps));
  Worlds parts(plan, {world(300), world(30)}, {});
  for (const int count : {1, 0, 7, 52}) parts.step(count);
  expect_same(state(together, 2), state(parts, 0));
  expect_same(state(together, 0), state(parts, 1));
}

// Which are done is often nobody.
TEST(Worlds, AListWithoutANumberMeansNone) {
  const Sheet sheet = small_sheet();
  Worlds worlds(make_sheet_plan(sheet), {on_a_table(sheet), on_a_table(sheet)}, {});
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

TEST(Worlds, SettersRefuseWhatIsWrongAndChangeNothing) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  const int vertices = plan->pattern.size;
  Worlds worlds(plan, {on_a_table(sheet), on_a_table(sheet)}, {}),
      untouched(plan, {on_a_table(sheet), on_a_table(sheet)}, {});
  const auto expect_refused = [](const auto& call, const std::string& part) {
    try {
      call();
      ADD_FAILURE() << "not refused: " << part;
    } catch (const data::InputError& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  };
  const std::vector<double> good = {0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1};
  const auto with = [&](std::size_t place, double value) {
    std::vector<double> numbers = good;
    numbers[place] = value;
    return numbers;
  };
  const auto poses = [&](const Chosen& environments, int frame, const Tensor& numbers) {
    worlds.set_poses(environments, frame, numbers);
  };
  const Tensor two = tensor(good, {2, 7});
  for (const int wrong : {-1, 2, 1 << 30})
    expect_refused(
        [&] {
          poses(std::vector{0, wrong}, 0, two);
        },
        "environment " + std::to_string(wrong) + ", expected 0 to 1");
  expect_refused([&] { poses(std::vector{1, 1}, 0, two); }, "environment 1 twice");
  for (const int wrong : {-1, 1})
    expect_refused([&] { poses({}, wrong, two); }, "environment 0: found frame");
  expect_refused([&] { poses(std::vector{0}, 0, two); }, "found 2 x 7 numbers, expected 1 x 7");
  expect_refused([&] { poses({}, 0, tensor(good, {14})); }, "found 14 numbers, expected 2 x 7");
  expect_refused([&] { poses({}, 0, {}); }, "found a number numbers");
  for (const double wrong : {nan, HUGE_VAL}) {
    const std::vector<double> numbers = with(9, wrong);
    expect_refused([&] { poses({}, 0, tensor(numbers, {2, 7})); }, "environment 1: found");
  }
  const std::vector<double> zero = with(13, 0), long_one = with(13, 1.1);
  expect_refused(
      [&] {
        poses({}, 0, tensor(zero, {2, 7}));
      },
      "environment 1: found a quaternion of length 0");
  expect_refused([&] { poses({}, 0, tensor(long_one, {2, 7})); }, "length 1.1");
  Tensor elsewhere = two, single = two, gaps = two, none = two;
  elsewhere.device = Device::cuda;
  single.type = NumberType::float32;
  gaps.strides = {8, 1};
  none.data = nullptr;
  expect_refused([&] { poses({}, 0, elsewhere); }, "CUDA device, expected the CPU's");
  expect_refused([&] { poses({}, 0, single); }, "found float32, expected float64");
  expect_refused([&] { poses({}, 0, gaps); }, "strides with gaps");
  expect_refused([&] { poses({}, 0, none); }, "found no numbers");

  for (const int hold : {-1, 2}) {
    expect_refused([&] { worlds.grasp({}, hold); }, "found hold " + std::to_string(hold));
    expect_refused([&] { worlds.release({}, hold); }, "found hold " + std::to_string(hold));
  }
  const auto grasp = [&](const Grasp& what) { worlds.grasp(std::vector{1}, 1, what); };
  expect_refused(
      [&] {
        grasp({.vertices = {0, vertices}});
      },
      "environment 1: hold 1: found a vertex that is not there");
  expect_refused([&] { grasp({.vertices = {-1}}); }, "not there");
  expect_refused([&] { grasp({.vertices = {3, 3}}); }, "found a vertex twice");
  expect_refused([&] { grasp({.vertices = {3}, .reach = Reach{}}); }, "expected one of them");
  expect_refused([&] { grasp({.reach = Reach{.threshold = nan}}); }, "threshold of nan");
  expect_refused([&] { grasp({.reach = Reach{.half_extents = {0, -1, 0}}}); }, "half extents");
  expect_refused([&] { grasp({.reach = Reach{.first_vertex = vertices}}); }, "vertices that are not there");
  expect_refused([&] { grasp({.reach = Reach{.first_vertex = 1, .vertex_count = vertices}}); }, "not there");

  data::SheetMaterial material;
  const auto set = [&] { worlds.set_materials(std::vector{1}, std::vector{material}); };
  for (double data::SheetMaterial::*field :
       {&data::SheetMaterial::membrane_stiffness, &data::SheetMaterial::poissons_ratio,
        &data::SheetMaterial::areal_density, &data::SheetMaterial::bending_rigidity,
        &data::SheetMaterial::friction, &data::SheetMaterial::air_drag,
        &data::SheetMaterial::stiffness_damping, &data::SheetMaterial::yield_curvature})
    for (const double wrong : {nan, -1.0}) {
      material = {};
      material.*field = wrong;
      expect_refused(set, "environment 1: material: ");
    }
  material = {};
  material.yield_curvature = 10;  // of a plate, which does not yield
  expect_refused(set, "environment 1: yield_curvature");
  material = {};
  expect_refused([&] { worlds.set_materials({}, std::vector{material}); }, "found 1 materials, expected 2");
  expect_refused([&] { worlds.set_materials(std::vector{0}, std::vector{material}, 1); }, "found body 1");
  expect_refused([&] { worlds.set_materials(std::vector{0}, std::vector{data::SolidMaterial{}}); },
                 "expected one of tetrahedra");

  std::vector<double> places(static_cast<std::size_t>(6 * vertices), 0.0);
  places[4] = nan;
  expect_refused(
      [&] {
        worlds.reset({}, tensor(places, {2, vertices, 3}));
      },
      "environment 0: found nan at 4");
  expect_refused(
      [&] {
        worlds.reset({}, {}, tensor(places, {2, vertices, 3}));
      },
      "velocities: environment 0");
  expect_refused([&] { worlds.reset({}, tensor(places, {2, vertices - 1, 3})); }, "expected 2 x ");
  expect_refused([&] { worlds.set_velocities({}, tensor(places, {2, vertices, 3})); }, "found nan");
  expect_refused([&] { worlds.reset(std::vector{7}); }, "environment 7");
  expect_refused([&] { (void)worlds.save(std::vector{-3}); }, "environment -3");
  expect_refused([&] { worlds.load({}, {}); }, "found 0 environments, expected 2");
  expect_refused([&] { worlds.load(std::vector{0}, worlds.save({})); }, "found 2 environments, expected 1");
  Worlds other(make_sheet_plan(small_sheet(5)), {environment_of(small_sheet(5))}, {});
  expect_refused([&] { worlds.load(std::vector{0}, other.save({})); }, "another plan");
  Worlds slower(plan, {on_a_table(sheet)}, {.solver = {.time_step = 0.02}});
  expect_refused([&] { worlds.load(std::vector{0}, slower.save({})); }, "time step");

  worlds.step(20);
  untouched.step(20);
  for (int e = 0; e < 2; ++e) expect_same(state(worlds, e), state(untouched, e));
}

TEST(Worlds, TheConstructorNamesTheEnvironmentThatDoesNotFit) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  const auto what_of = [&](std::vector<Environment> environments,
                           const WorldSettings& settings) -> std::string {
    try {
      Worlds(plan, std::move(environments), settings);
    } catch (const std::exception& error) {
      return error.what();
    }
    return "not refused";
  };
  std::vector<Environment> environments(3, on_a_table(sheet));
  environments[2].state.positions.conservativeResize(5, 3);
  EXPECT_NE(what_of(environments, {}).find("environment 2: "), std::string::npos);
  environments[2] = on_a_table(sheet);
  environments[1].holds.pop_back();
  EXPECT_NE(what_of(environments, {}).find("environment 1: "), std::string::npos);
  environments[1] = on_a_table(sheet);
  environments[1].materials[0].yield_curvature = 3;
  EXPECT_NE(what_of(environments, {}).find("environment 1: "), std::string::npos);
  EXPECT_NE(what_of({on_a_table(sheet)}, {.device = Device::cuda}).find("found cuda"), std::string::npos);
}

}  // namespace
}  // namespace flash::sim
