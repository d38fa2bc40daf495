#include "sim/live_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "data/files/error.h"
#include "tests/sim/live_scene_fixture.h"

namespace flash::sim {
namespace {

TEST_F(LiveScenes, EachEnvironmentIsTheSameAlone) {
  for (const bool meet : {false, true}) {
    LiveScene all(scene(true, meet), 3, 2);
    all.add_end_effector(hand(), tensor(poses(3, 0.05), {3, 7}));
    drive(all, 0, 20);
    EXPECT_GT(all.held("hand")[2], 0);
    for (int e = 0; e < 3; ++e) {
      LiveScene alone(scene(true, meet), 1, 1);
      const std::vector<double> own = poses(3, 0.05);
      const std::vector<double> start(own.begin() + 7 * e, own.begin() + 7 * (e + 1));
      alone.add_end_effector(hand(), tensor(start, {1, 7}));
      for (int k = 0; k < 20; ++k) {
        std::vector<double> now = poses(1, height(k));
        now[0] = 0.2 - 0.001 * e;
        alone.move_end_effector("hand", {}, tensor(now, {1, 7}));
        if (k >= 12) alone.close("hand", {});
        alone.step();
      }
      for (const char* object : {"a", "b"}) {
        EXPECT_EQ(row(all.positions(object), e), row(alone.positions(object), 0));
        EXPECT_EQ(row(all.velocities(object), e), row(alone.velocities(object), 0));
      }
      EXPECT_EQ(row(all.force("hand"), e), row(alone.force("hand"), 0));
      EXPECT_EQ(row(all.status(), e), row(alone.status(), 0));
    }
  }
}

// At rest the hand carries the weight that the table does not.
TEST_F(LiveScenes, AHandThatHoldsAllOfASheetCarriesItsWeight) {
  LiveScene live(scene(false, false), 1, 1);
  EndEffector large = hand();
  large.half_extents = {0.2, 0.2, 0.01};
  std::vector<double> pose = {0.1, 0.1, 0.011, 0, 0, 0, 1};
  live.add_end_effector(large, tensor(pose, {1, 7}));
  live.close("hand", {});
  for (int k = 0; k < 40; ++k) {
    pose[2] = 0.011 + 0.002 * std::min(k, 20);
    live.move_end_effector("hand", {}, tensor(pose, {1, 7}));
    live.step();
  }
  EXPECT_EQ(live.held("hand")[0], live.objects()[0].vertices);
  // As exactly as a step is solved: a thousandth of the weight.
  const double weight = 0.2 * 0.2 * 0.2 * 9.81;
  EXPECT_NEAR(row(live.force("hand"), 0)[2], weight, 1e-3 * weight);
}

// Two sheets apart from each other lie on one table; m g each. A hand on one of them takes its share.
TEST_F(LiveScenes, ATableBearsAllObjectsButForWhatAHandCarries) {
  LiveScene live(scene(true, false), 2, 1);
  live.add_end_effector(hand(), tensor(poses(2, 0.05), {2, 7}));
  const double weight = 2 * 0.2 * 0.2 * 0.2 * 9.81;
  drive(live, 0, 10);
  for (int e = 0; e < 2; ++e) EXPECT_NEAR(row(live.force("table"), e)[2], weight, 1e-3 * weight);
  drive(live, 10, 30);
  const std::vector<double> still = poses(2, height(29));
  live.move_end_effector("hand", {}, tensor(still, {2, 7}));
  live.step(100);
  for (int e = 0; e < 2; ++e) {
    EXPECT_NEAR(row(live.force("table"), e)[2] + row(live.force("hand"), e)[2], weight, 1e-2 * weight);
    EXPECT_GT(row(live.force("hand"), e)[2], 1e-2 * weight);
  }
  EXPECT_EQ(live.device().device, Device::cpu);
  EXPECT_EQ(live.on_device(live.force("table")).data, live.force("table").data);
}

TEST_F(LiveScenes, AClosedHandTakesNothingUntilItHasOpened) {
  LiveScene live(scene(false, false), 1, 1);
  live.add_end_effector(hand(), tensor(poses(1, 0.05), {1, 7}));
  live.close("hand", {});  // in the air
  drive(live, 0, 13);
  EXPECT_EQ(live.held("hand")[0], 0);
  live.open("hand", {});
  live.step();
  live.close("hand", {});
  live.step();
  EXPECT_GT(live.held("hand")[0], 0);
}

TEST_F(LiveScenes, WhatIsSavedGoesOnAndWhatIsResetBeginsAgain) {
  LiveScene live(scene(true, false), 2, 1);
  live.add_end_effector(hand(), tensor(poses(2, 0.05), {2, 7}));
  const double* place = static_cast<const double*>(live.positions("b").data);
  drive(live, 0, 12);
  const auto saved = live.save({});
  drive(live, 12, 20);
  const std::vector<double> end = row(live.positions("a"), 1), force = row(live.force("hand"), 1);
  live.load({}, *saved);
  EXPECT_EQ(row(live.pose("hand"), 1)[2], height(11));
  drive(live, 12, 20);
  EXPECT_EQ(row(live.positions("a"), 1), end);
  EXPECT_EQ(row(live.force("hand"), 1), force);
  live.reset(std::vector{1});
  EXPECT_EQ(row(live.pose("hand"), 1)[2], 0.05);
  EXPECT_EQ(live.held("hand")[1], 0);
  EXPECT_GT(live.held("hand")[0], 0);
  live.reset({});
  drive(live, 0, 20);
  EXPECT_EQ(row(live.positions("a"), 1), end);
  EXPECT_EQ(live.positions("b").data, place);
  LiveScene other(scene(true, false), 2, 1);
  EXPECT_THROW(other.load({}, *saved), data::InputError);
}

TEST_F(LiveScenes, PositionsOfOneObjectLeaveTheOther) {
  for (const bool meet : {false, true}) {
    LiveScene live(scene(true, meet), 2, 1);
    std::vector<double> raised = row(live.positions("b"), 0);
    const std::vector<double> start = row(live.positions("a"), 0);
    for (std::size_t i = 2; i < raised.size(); i += 3) raised[i] += 0.5;
    const std::vector<double> falling(raised.size(), -1.0);
    const std::int64_t count = live.objects()[1].vertices;
    live.reset(std::vector{1}, {{}, tensor(raised, {1, count, 3})});
    live.set_velocities("b", std::vector{1}, tensor(falling, {1, count, 3}));
    EXPECT_EQ(row(live.positions("b"), 1), raised);
    EXPECT_EQ(row(live.velocities("b"), 1), falling);
    EXPECT_EQ(row(live.positions("a"), 1), start);
    EXPECT_NE(row(live.positions("b"), 0), raised);
  }
}

TEST_F(LiveScenes, MaterialsAreThoseOfEachEnvironment) {
  LiveScene live(scene(true, true), 2, 1);
  live.set_material("b", std::vector{1}, {{"bending_rigidity", {1e-4}}, {"friction", {0.9}}});
  const auto value = [&](const char* object, const std::string& name, std::size_t e) {
    for (const auto& [known, numbers] : live.material(object))
      if (known == name) return numbers[e];
    return std::numeric_limits<double>::quiet_NaN();
  };
  EXPECT_EQ(value("b", "bending_rigidity", 1), 1e-4);
  EXPECT_EQ(value("b", "friction", 1), 0.9);
  EXPECT_EQ(value("b", "bending_rigidity", 0), 3e-5);
  EXPECT_EQ(value("a", "bending_rigidity", 1), 3e-5);
  EXPECT_EQ(value("b", "membrane_stiffness", 1), 100);  // E t
  EXPECT_THROW(live.set_material("b", {}, {{"bending", {1, 1}}}), data::InputError);
  EXPECT_THROW(live.set_material("b", {}, {{"friction", {1}}}), data::InputError);
  EXPECT_THROW(live.set_material("b", {}, {{"friction", {1, -1}}}), data::InputError);
  EXPECT_THROW(live.set_material("c", {}, {{"friction", {1, 1}}}), data::InputError);
  EXPECT_EQ(value("b", "friction", 1), 0.9);
  // The table states no friction until it is set for both environments.
  live.set_friction("b", "table", std::vector{0}, {0.4});
  EXPECT_TRUE(live.uses_material_friction("b"));
  live.set_friction("b", "table", std::vector{1}, {0.4});
  EXPECT_FALSE(live.uses_material_friction("b"));
  EXPECT_TRUE(live.uses_material_friction("a"));
}

TEST_F(LiveScenes, NamesAndEnvironmentsAreRefused) {
  LiveScene live(scene(true, false), 2, 1);
  const std::vector<double> start = poses(2, 0.05);
  EndEffector named = hand();
  for (const char* name : {"", "table"}) {
    named.name = name;
    EXPECT_THROW(live.add_end_effector(named, tensor(start, {2, 7})), data::InputError);
  }
  live.add_end_effector(hand(), tensor(start, {2, 7}));
  EXPECT_THROW(live.add_end_effector(hand(), tensor(start, {2, 7})), data::InputError);
  EXPECT_THROW(live.positions("hand"), data::InputError);
  EXPECT_THROW(live.force("a"), data::InputError);
  for (const std::vector<int>& numbers : {std::vector{2}, std::vector{-1}, std::vector{0, 0}}) {
    EXPECT_THROW(live.close("hand", numbers), data::InputError);
    EXPECT_THROW(live.reset(numbers), data::InputError);
    EXPECT_THROW(live.save(numbers), data::InputError);
  }
  EXPECT_THROW(LiveScene(scene(true, false), 0, 1), data::InputError);
}

// Asked to stop all the time, it does within a step, and is whole again after a reset.
TEST_F(LiveScenes, AStepThatWasStoppedIsNotGoneOnWith) {
  LiveScene live(scene(true, false), 2, 1);
  const std::vector<double> start = row(live.positions("a"), 0);
  std::thread stopper;
  std::atomic<bool> ended = false;
  EXPECT_THROW(
      {
        stopper = std::thread([&] {
          while (!ended) {
            live.stop();
            std::this_thread::yield();
          }
        });
        live.step(1000000);
      },
      data::Stopped);
  ended = true;
  stopper.join();
  EXPECT_THROW(live.step(), data::InputError);
  live.reset(std::vector{0});
  EXPECT_THROW(live.step(), data::InputError);
  live.reset({});
  EXPECT_EQ(row(live.positions("a"), 0), start);
  live.step();
}

}  // namespace
}  // namespace flash::sim
