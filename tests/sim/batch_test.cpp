#include "sim/batch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "data/files/error.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

/// A sheet that is lifted by a corner off a table, on which it slips.
Environment lifted(const Sheet& sheet, double stiffness) {
  Environment environment = environment_of(sheet);
  environment.materials[0].membrane_stiffness = stiffness;
  environment.materials[0].friction = 0.2;
  environment.obstacles.push_back({Plane{}});
  data::Trajectory gripper;
  for (int k = 0; k <= 2; ++k) {
    gripper.times.push_back(0.7 * k);
    gripper.poses.push_back(
        Eigen::Isometry3d(Eigen::Translation3d(0.02 * k, 0.01 * k, 0.04 * k * (2 - 0.7 * k))));
  }
  environment.holds = {gripped(environment, {0, 1}, gripper)};
  return environment;
}

std::vector<Environment> three_lifts(const Sheet& sheet) {
  return {lifted(sheet, 30), lifted(sheet, 100), lifted(sheet, 300)};
}

/// Equal in every bit: positions, velocities, and how the solver went.
void expect_same(const State& a, const State& b) {
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.velocities, b.velocities);
  EXPECT_EQ(a.time, b.time);
}

TEST(Batch, EqualsItsEnvironmentsAloneBitForBit) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  const std::vector<Environment> environments = three_lifts(sheet);
  Batch together(plan, environments, {.steps = 60, .threads = 2});
  Batch reversed(plan, {environments.rbegin(), environments.rend()}, {.steps = 60, .threads = 1});
  together.advance(60);
  reversed.advance(60);
  for (int e = 0; e < 3; ++e) {
    Batch alone(make_sheet_plan(sheet), {environments[e]}, {.steps = 60});
    alone.advance(60);
    expect_same(together.state(e), alone.state(0));
    expect_same(together.state(e), reversed.state(2 - e));
    EXPECT_GT((alone.state(0).positions - sheet.rest.vertices).cwiseAbs().maxCoeff(), 0.01);
  }
}

TEST(Batch, AdvancesInPartsAsInOne) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  Batch whole(plan, three_lifts(sheet), {.steps = 60}), parts(plan, three_lifts(sheet), {.steps = 60});
  whole.advance(60);
  for (const int steps : {1, 7, 0, 52}) parts.advance(steps);
  EXPECT_EQ(parts.step(), 60);
  for (int e = 0; e < 3; ++e) expect_same(whole.state(e), parts.state(e));
}

TEST(Batch, GoesOnFromAStateAsIfItHadNotBeenInterrupted) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  const int interrupted = 2 * restart_interval, steps = interrupted + 30;
  Batch whole(plan, three_lifts(sheet), {.steps = steps});
  Batch before(plan, three_lifts(sheet), {.steps = interrupted});
  whole.advance(steps);
  before.advance(interrupted);
  std::vector<Environment> environments = three_lifts(sheet);
  for (int e = 0; e < 3; ++e) environments[e].state = before.state(e);
  Batch after(plan, environments, {.steps = steps, .first_step = interrupted});
  after.advance(30);
  for (int e = 0; e < 3; ++e) {
    expect_same(whole.state(e), after.state(e));
    EXPECT_EQ(after.stats(e).size(), 30u);
    EXPECT_EQ(after.stats(e).back().residual, whole.stats(e).back().residual);
  }
}

TEST(Batch, KeepsTheStepsThatAreWanted) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  Batch batch(plan, three_lifts(sheet), {.steps = 20, .kept_steps = {0, 7, 20}, .threads = 2});
  std::vector<int> finished(3, 0);
  batch.advance(20, [&](int e) { ++finished[e]; });
  EXPECT_EQ(finished, std::vector<int>(3, 1));
  const View<double> kept = batch.kept_positions(), now = batch.positions(), forces = batch.hold_forces();
  EXPECT_EQ(kept.shape, (std::vector<std::ptrdiff_t>{3, 3, sheet.rest.vertices.rows(), 3}));
  EXPECT_EQ(forces.shape, (std::vector<std::ptrdiff_t>{3, 20, 1, 3}));
  for (int e = 0; e < 3; ++e) {
    // The oracle is one solver, step by step.
    Environment environment = three_lifts(sheet)[e];
    Solver solver(plan, {});
    EXPECT_EQ(batch.kept_positions(e, 0), environment.state.positions);
    for (int k = 1; k <= 20; ++k) {
      const StepReport report = solver.step(environment);
      if (k == 7) {
        EXPECT_EQ(batch.kept_positions(e, 1), environment.state.positions);
      }
      for (int axis = 0; axis < 3; ++axis)
        EXPECT_EQ(forces.data[e * forces.strides[0] + (k - 1) * forces.strides[1] + axis],
                  report.hold_forces[0][axis]);
      EXPECT_EQ(batch.stats(e)[k - 1].iterations, report.iterations);
    }
    EXPECT_EQ(batch.kept_positions(e, 2), environment.state.positions);
    for (int i = 0; i < environment.state.positions.rows(); ++i)
      for (int axis = 0; axis < 3; ++axis)
        EXPECT_EQ(now.data[e * now.strides[0] + i * now.strides[1] + axis * now.strides[2]],
                  environment.state.positions(i, axis));
  }
}

bool same(const ContactForce& a, const ContactForce& b) {
  return a.kind == b.kind && a.body == b.body && a.other == b.other && a.vertices == b.vertices &&
         a.point == b.point && a.other_point == b.other_point && a.normal == b.normal &&
         a.normal_force == b.normal_force && a.friction == b.friction && a.couple == b.couple;
}

TEST(Batch, ContactsAreThoseOfItsEnvironmentsAloneBitForBit) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  std::vector<Environment> environments = three_lifts(sheet);
  environments[1].obstacles.push_back({Plane{.point = {0, 0, -1}}});  // never met
  for (const int threads : {1, 2, 5}) {
    Batch batch(plan, environments, {.steps = 30, .contacts = true, .threads = threads});
    Batch without(plan, environments, {.steps = 30, .threads = threads});
    without.advance(30);
    EXPECT_EQ(batch.body_resultants().shape, (std::vector<std::ptrdiff_t>{3, 1, 6}));
    EXPECT_EQ(batch.obstacle_resultants().shape, (std::vector<std::ptrdiff_t>{3, 2, 6}));
    EXPECT_EQ(without.obstacle_resultants().shape, (std::vector<std::ptrdiff_t>{3, 0, 6}));
    for (int part = 0; part < 2; ++part) {
      batch.advance(15);
      batch.advance(0);
      const View<double> bodies = batch.body_resultants(), obstacles = batch.obstacle_resultants();
      for (int e = 0; e < 3; ++e) {
        Environment alone = environments[static_cast<std::size_t>(e)];
        Solver solver(plan, {});
        for (int k = 0; k < 15 * (part + 1); ++k) solver.step(alone);
        const std::vector<ContactForce> expected = solver.contacts(alone);
        EXPECT_GT(expected.size(), 5u);
        EXPECT_TRUE(std::ranges::equal(batch.contacts(e), expected, same)) << threads << ' ' << e;
        Eigen::Vector3d force = Eigen::Vector3d::Zero();
        for (const ContactForce& contact : expected) force += contact.force();
        for (int axis = 0; axis < 3; ++axis) {
          EXPECT_EQ(bodies.data[e * bodies.strides[0] + axis], force[axis]);
          EXPECT_EQ(obstacles.data[e * obstacles.strides[0] + axis], -force[axis]);
          EXPECT_EQ(obstacles.data[e * obstacles.strides[0] + obstacles.strides[1] + axis], 0);
        }
        EXPECT_TRUE(without.contacts(e).empty());
      }
    }
  }
}

// A plate needs a flat rest shape.
TEST(Batch, NamesTheEnvironmentThatItsMeshCannotBe) {
  data::TriangleMesh curved = data::rectangle({.width = 0.1, .height = 0.1, .cells_x = 3, .cells_y = 3});
  for (Eigen::Index i = 0; i < curved.vertices.rows(); ++i)
    curved.vertices(i, 2) = 5 * curved.vertices(i, 0) * curved.vertices(i, 0);
  const Sheet sheet = make_sheet(curved);
  std::vector<Environment> environments(4, environment_of(sheet));
  for (Environment& environment : environments)
    environment.materials[0].bending_model = data::BendingModel::hinge;
  environments[2].materials[0].bending_model = data::BendingModel::plate;
  try {
    Batch(make_sheet_plan(sheet), environments, {.steps = 2});
    ADD_FAILURE() << "not refused";
  } catch (const data::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("environment 2: "), std::string::npos) << error.what();
  }
}

// What is thrown on a worker must reach the caller, not end the program.
TEST(Batch, WhatAWorkerThrowsReachesTheCaller) {
  const Sheet sheet = small_sheet();
  for (const int threads : {1, 2, 4}) {
    Batch batch(make_sheet_plan(sheet), std::vector(4, environment_of(sheet)),
                {.steps = 2, .threads = threads});
    EXPECT_THROW(batch.advance(1, [](int e) { throw std::length_error(std::to_string(e)); }),
                 std::length_error)
        << threads;
    EXPECT_EQ(batch.step(), -1);
    EXPECT_THROW(batch.advance(1), std::invalid_argument);
  }
}

TEST(Batch, OneMissedGraspEndsNoOther) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  std::vector<Environment> environments = three_lifts(sheet);
  for (Environment& environment : environments)
    environment.holds.push_back(
        {.name = "left", .from = 0.1, .reach = Reach{.object = "towel", .threshold = 0.05}});
  environments[1].holds[1].reach->threshold = 1e-9;
  environments[1].holds[1].reach->first_vertex = 20;
  Batch batch(plan, environments, {.steps = 30, .kept_steps = {10, 30}, .threads = 2}),
      alone(plan, {environments[0], environments[2]}, {.steps = 30});
  std::vector<int> finished(3, 0);
  for (const int steps : {15, 15})
    batch.advance(steps, [&](int e) { ++finished[static_cast<std::size_t>(e)]; });
  alone.advance(30);
  EXPECT_EQ(finished, std::vector<int>(3, 2));
  expect_same(batch.state(0), alone.state(0));
  expect_same(batch.state(2), alone.state(1));
  EXPECT_EQ(batch.why_lost(0), "");
  EXPECT_EQ(batch.lost(1), Lost::no_vertex_in_reach);
  EXPECT_NE(batch.why_lost(1).find("end effector left: grasps: no vertex of towel"), std::string::npos)
      << batch.why_lost(1);
  EXPECT_EQ(batch.kept_positions(1, 0), batch.kept_positions(1, 1));  // where it was
  for (int k = 0; k < 30; ++k) {
    EXPECT_EQ(std::isfinite(batch.stats(1)[static_cast<std::size_t>(k)].residual), k < 10);
    EXPECT_EQ(batch.stats(1)[static_cast<std::size_t>(k)].converged, k < 10);
  }
}

TEST(Batch, StopsBeforeTheNextStepWhenAsked) {
  const Sheet sheet = small_sheet();
  std::atomic<bool> stop = true;
  SolverSettings solver;
  solver.stop = &stop;
  // A million steps would take minutes.
  Batch batch(make_sheet_plan(sheet), {environment_of(sheet)}, {.solver = solver, .steps = 1'000'000});
  EXPECT_THROW(batch.advance(1'000'000), data::Stopped);
}

TEST(Batch, RefusesWhatDoesNotFit) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  const std::vector<Environment> one = {environment_of(sheet)};
  EXPECT_THROW(Batch(plan, one, {.steps = -1}), std::invalid_argument);
  EXPECT_THROW(Batch(plan, one, {.steps = 5, .kept_steps = {3, 3}}), std::invalid_argument);
  EXPECT_THROW(Batch(plan, one, {.steps = 5, .kept_steps = {6}}), std::invalid_argument);
  EXPECT_THROW(Batch(plan, one, {.steps = 5, .kept_steps = {1}, .first_step = 2}), std::invalid_argument);
  EXPECT_THROW(Batch(plan, {environment_of(small_sheet(5))}, {}), std::invalid_argument);
  EXPECT_THROW(Batch(plan, {one[0], lifted(sheet, 30)}, {}), std::invalid_argument);
  EXPECT_THROW(Batch(plan, one, {.steps = 5}).advance(6), std::invalid_argument);
  const auto make = [&](std::size_t) { return one[0]; };
  const auto ignore = [](std::size_t, const Batch&, int) {};
  EXPECT_THROW(replay_in_batches(plan, 1, 0, {.steps = 1}, make, ignore), std::invalid_argument);
}

}  // namespace
}  // namespace flash::sim
