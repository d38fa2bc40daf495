// End effectors that code adds to worlds, and what else it sets there.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "data/files/error.h"
#include "tests/sim/sheet_scene.h"
#include "tests/sim/worlds_scene.h"

namespace flash::sim {
namespace {

/// The k-th pose of the effector that is added: down to the sheet, then up.
Eigen::Matrix<double, 7, 1> added_pose(int k) {
  Eigen::Matrix<double, 7, 1> pose = pose_numbers(0);
  pose.head<3>() += Eigen::Vector3d(0.1, 0.1, 0.04 - 0.004 * std::min(k, 7) + 0.003 * std::max(0, k - 12));
  return pose;
}

EndEffector hand() {
  return {.name = "hand",
          .half_extents = Eigen::Vector3d(0.02, 0.02, 0.01),
          .threshold = 0.003,
          .collides = true,
          .friction = 0.7};
}

std::vector<double> twice(const Eigen::Matrix<double, 7, 1>& pose) {
  std::vector<double> numbers(pose.begin(), pose.end());
  numbers.insert(numbers.end(), pose.begin(), pose.end());
  return numbers;
}

/// The same written into the environment.
Environment with_hand(Environment environment) {
  Schedule schedule = *environment.schedule;
  const int frame = static_cast<int>(schedule.frames.size());
  schedule.frames.push_back({data::from_vector(added_pose(0))});
  environment.schedule = std::make_shared<const Schedule>(schedule);
  const EndEffector own = hand();
  environment.holds.push_back({.name = own.name,
                               .frame = frame,
                               .from = std::numeric_limits<double>::infinity(),
                               .reach = Reach{.half_extents = own.half_extents, .threshold = own.threshold}});
  environment.obstacles.push_back({.shape = Box{.half_extents = own.half_extents},
                                   .friction = {*own.friction},
                                   .name = own.name,
                                   .frame = frame});
  return environment;
}

/// Down, close, up with the sheet; another frame moves too.
void drive(Worlds& worlds, int steps) {
  for (int k = 0; k < steps; ++k) {
    worlds.set_poses({}, 1, tensor(twice(added_pose(k + 1)), {2, 7}));
    if (k == 8) worlds.grasp({}, 2, {.may_miss = true});
    worlds.step();
  }
}

TEST(EndEffectors, OneThatIsAddedIsOneThatWasThere) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  Worlds there(plan, {with_hand(on_a_table(sheet)), with_hand(on_a_table(sheet, 1000))}, {});
  Worlds added(plan, {on_a_table(sheet), on_a_table(sheet, 1000)}, {});
  const double* before = static_cast<const double*>(added.positions().data);
  // A frame that is given poses before the effector is added goes on.
  for (Worlds* worlds : {&there, &added}) worlds->set_poses({}, 0, tensor(twice(pose_numbers(1)), {2, 7}));
  const EndEffectorNumbers numbers = added.add(hand(), tensor(twice(added_pose(0)), {2, 7}));
  EXPECT_EQ(numbers.frame, 1);
  EXPECT_EQ(numbers.hold, 2);
  EXPECT_EQ(numbers.obstacle, 2);
  drive(there, 30);
  drive(added, 30);
  for (int e = 0; e < 2; ++e) expect_same(state(there, e), state(added, e));
  EXPECT_GT(state(added, 0).held[2].vertices.size(), 1u);
  EXPECT_EQ(before, added.positions().data);
  // After a reset it stands at its start again, open.
  const State first = state(added, 0);
  added.reset({});
  EXPECT_TRUE(state(added, 0).held.empty());
  added.set_poses({}, 0, tensor(twice(pose_numbers(1)), {2, 7}));
  drive(added, 30);
  expect_same(first, state(added, 0));
}

TEST(EndEffectors, BadOnesAreRefused) {
  const Sheet sheet = small_sheet();
  Worlds worlds(make_sheet_plan(sheet), {on_a_table(sheet), on_a_table(sheet)}, {});
  const std::vector<double> poses = twice(added_pose(0));
  const auto refusal = [&](const EndEffector& effector, const std::vector<double>& numbers) -> std::string {
    try {
      worlds.add(effector, tensor(numbers, {2, static_cast<std::int64_t>(numbers.size()) / 2}));
    } catch (const data::InputError& error) {
      return error.what();
    }
    return "";
  };
  EndEffector flat = hand(), far = hand(), slippery = hand();
  flat.half_extents.z() = 0;
  far.threshold = std::nan("");
  slippery.friction = -1;
  EXPECT_NE(refusal(flat, poses).find("half extents above 0"), std::string::npos);
  EXPECT_NE(refusal(far, poses).find("0 m or more"), std::string::npos);
  EXPECT_NE(refusal(slippery, poses).find("friction"), std::string::npos);
  std::vector<double> bad = poses;
  bad[9] = std::nan("");
  EXPECT_NE(refusal(hand(), bad).find("environment 1: found nan"), std::string::npos);
  bad[9] = 1e9;
  EXPECT_NE(refusal(hand(), bad).find("environment 1: found 1e+09 m"), std::string::npos);
  bad = poses;
  bad[6] = 2;
  EXPECT_NE(refusal(hand(), bad).find("quaternion"), std::string::npos);
  EXPECT_NE(refusal(hand(), {1, 2}).find("expected 2 x 7"), std::string::npos);
  worlds.step();
  EXPECT_NE(refusal(hand(), poses).find("before the first"), std::string::npos);
  EXPECT_EQ(worlds.hold_forces().shape[1], 2);
}

TEST(EndEffectors, GravityAndFrictionAreThoseOfAnEnvironmentThatHasThem) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  Environment own = on_a_table(sheet);
  own.gravity = {1, 0, -3};
  own.obstacles[0].friction = {0.05};
  Worlds there(plan, {own}, {}), set(plan, {on_a_table(sheet), on_a_table(sheet)}, {});
  set.set_gravity(std::vector{1}, tensor({1, 0, -3}, {1, 3}));
  set.set_friction(std::vector{1}, 0, std::vector{0.05});
  there.step(20);
  set.step(20);
  expect_same(state(there, 0), state(set, 1));
  EXPECT_NE(state(set, 0).positions, state(set, 1).positions);
  EXPECT_THROW(set.set_friction({}, 0, std::vector{0.1, -1.0}), data::InputError);
  EXPECT_THROW(set.set_friction({}, 2, std::vector{0.1, 0.1}), data::InputError);
  EXPECT_THROW(set.set_friction({}, 0, std::vector{0.1, 0.1}, 1), data::InputError);
  EXPECT_THROW(set.set_gravity({}, tensor({1, 0, -3}, {1, 3})), data::InputError);
}

}  // namespace
}  // namespace flash::sim
