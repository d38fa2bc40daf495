#include "sim/live_cameras.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "data/files/error.h"
#include "data/scene/scene.h"
#include "sim/live_scene.h"

namespace flash::sim {
namespace {

using Eigen::Isometry3d, Eigen::Vector3d;

/// A camera of 40 x 30 pixels.
data::CameraIntrinsics lens() {
  data::CameraIntrinsics lens;
  lens.width = 40, lens.height = 30;
  lens.fx = 40, lens.fy = 40, lens.cx = 19.5, lens.cy = 14.5;
  return lens;
}

Tensor tensor(const std::vector<double>& numbers) {
  return {.data = numbers.data(), .shape = {std::ssize(numbers) / 7, 7}};
}

/// Looks straight down from above the middle of the sheet; the same in all environments.
std::vector<double> from_above(int environments, double height) {
  std::vector<double> all;
  for (int e = 0; e < environments; ++e)
    for (const double number : {0.1, 0.1, height, 1.0, 0.0, 0.0, 0.0}) all.push_back(number);
  return all;
}

/// Two sheets that do not meet, one over the other, a table and a box that moves 0.1 m/s up.
class LiveCamerasOf : public testing::Test {
 protected:
  LiveCamerasOf()
      : folder_(
            std::filesystem::temp_directory_path() /
            ("flash_cameras_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()))) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ / "towel.json")
        << R"({"schema": "flash-asset/1", "mesh": "sheet:0.2x0.2:0.1", "element_type": "TRIANGLE",
               "mechanical_props": {"areal_density": 0.2, "thickness": 0.001, "young": 1e5, "poisson": 0.3,
               "constitutive": "TRI_COROTATED", "bending_rigidity": 3e-5, "friction": 0.3}})";
    std::ofstream(folder_ / "scene.json") << R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 100,
      "gravity": [0, 0, 0], "obstacles": {"table": {"shape": "plane", "normal": [0, 0, 1], "point": [0, 0, -0.1]},
      "lift": {"shape": "box", "size": [0.1, 0.1, 0.02], "keyframes": [
        {"t": 0, "translation": [0.1, 0.1, 0.2], "rotation_xyzw": [0, 0, 0, 1]},
        {"t": 1, "translation": [0.1, 0.1, 0.3], "rotation_xyzw": [0, 0, 0, 1]}]}},
      "objects": {"low": "towel.json",
                  "high": {"asset": "towel.json", "start": {"T_base_object": [0, 0, 0.05, 0, 0, 0, 1]}}}})";
  }
  ~LiveCamerasOf() override { std::filesystem::remove_all(folder_); }

  LiveScene live(int environments) const {
    return {data::load_scene((folder_ / "scene.json").string()), environments, 2};
  }

  std::filesystem::path folder_;
};

/// What the middle of a picture sees: its depth, by its instance.
struct Middle {
  float depth;
  int instance;
};

std::vector<Middle> middles(const LiveScene& live, const std::string& camera) {
  const auto count = static_cast<std::size_t>(live.size());
  std::vector<float> depth(1200 * count);
  std::vector<std::uint8_t> instance(1200 * count);
  live.render(camera, {}, {.depth = depth.data(), .instance = instance.data()});
  std::vector<Middle> all;
  for (std::size_t e = 0; e < count; ++e)
    all.push_back({depth[1200 * e + 15 * 40 + 20], instance[1200 * e + 15 * 40 + 20]});
  return all;
}

TEST_F(LiveCamerasOf, AnyWorldsSeeWhatTheyAreToldToSee) {
  LiveScene scene = live(2);
  EXPECT_EQ(scene.instances(), (std::vector<std::string>{"high", "low", "lift", "table"}));
  const std::vector<double> poses = from_above(2, 1.0);
  scene.add_camera({"all", lens(), "", {}}, tensor(poses));
  for (const std::string& name : scene.instances())
    scene.add_camera({name, lens(), "", {name}}, tensor(poses));
  const std::vector<std::pair<std::string, double>> expected = {
      {"all", 0.79}, {"high", 0.95}, {"low", 1}, {"lift", 0.79}, {"table", 1.1}};
  for (std::size_t k = 0; k < expected.size(); ++k)
    for (const Middle& seen : middles(scene, expected[k].first)) {
      EXPECT_FLOAT_EQ(seen.depth, static_cast<float>(expected[k].second)) << expected[k].first;
      EXPECT_EQ(seen.instance, k == 0 ? 2 : static_cast<int>(k) - 1);
    }
}

TEST_F(LiveCamerasOf, WhatMovesIsSeenWhereItIsNow) {
  LiveScene scene = live(1);
  scene.add_end_effector({.name = "hand", .half_extents = {0.02, 0.02, 0.01}, .collides = false},
                         tensor({0.1, 0.1, 0.5, 0, 0, 0, 1}));
  scene.add_camera({"of hand", lens(), "", {"hand"}}, tensor(from_above(1, 1.0)));
  scene.add_camera({"of lift", lens(), "", {"lift"}}, tensor(from_above(1, 1.0)));
  scene.add_camera({"in hand", lens(), "hand", {"lift"}}, tensor({0, 0, 0, 1, 0, 0, 0}));
  const auto expect = [&](double of_hand, double of_lift, double in_hand) {
    EXPECT_FLOAT_EQ(middles(scene, "of hand")[0].depth, static_cast<float>(of_hand));
    EXPECT_FLOAT_EQ(middles(scene, "of lift")[0].depth, static_cast<float>(of_lift));
    EXPECT_FLOAT_EQ(middles(scene, "in hand")[0].depth, static_cast<float>(in_hand));
  };
  expect(0.49, 0.79, 0.29);
  scene.move_end_effector("hand", {}, tensor({0.1, 0.1, 0.6, 0, 0, 0, 1}));
  expect(0.49, 0.79, 0.29);  // at the end of the next step
  scene.step();
  expect(0.39, 0.789, 0.389);
  scene.step(9);
  expect(0.39, 0.78, 0.38);
  scene.reset({});
  expect(0.49, 0.79, 0.29);
}

TEST_F(LiveCamerasOf, PosesAreOfTheEnvironmentsChosen) {
  LiveScene scene = live(3);
  scene.add_camera({"eye", lens(), "", {"table"}}, tensor(from_above(3, 1.0)));
  const std::vector<int> chosen = {2, 0};
  std::vector<double> poses = from_above(2, 2.0);
  poses[9] = 3;
  scene.set_camera("eye", chosen, tensor(poses));
  const std::vector<Middle> seen = middles(scene, "eye");
  EXPECT_FLOAT_EQ(seen[0].depth, 3.1F);
  EXPECT_FLOAT_EQ(seen[1].depth, 1.1F);
  EXPECT_FLOAT_EQ(seen[2].depth, 2.1F);
  std::vector<float> depth(2400);
  scene.render("eye", chosen, {.depth = depth.data()});
  EXPECT_FLOAT_EQ(depth[0], 2.1F);
  EXPECT_FLOAT_EQ(depth[1200], 3.1F);
}

TEST_F(LiveCamerasOf, WhatIsNoCameraIsRefusedAndLeavesNone) {
  LiveScene scene = live(2);
  const std::vector<double> poses = from_above(2, 1.0);
  const auto refused = [&](const LiveCamera& camera, const std::vector<double>& at, const std::string& what) {
    try {
      scene.add_camera(camera, tensor(at));
      ADD_FAILURE() << what;
    } catch (const data::InputError& error) {
      EXPECT_EQ(std::string(error.what()).find(what), 0u) << error.what();
    }
  };
  refused({"", lens(), "", {}}, poses, "name: found");
  refused({"eye", {}, "", {}}, poses, "camera: found");
  refused({"eye", lens(), "foot", {}}, poses, "carrier: found");
  refused({"eye", lens(), "table", {}}, poses, "carrier: found");
  refused({"eye", lens(), "", {"foot"}}, poses, "sees: found");
  refused({"eye", lens(), "", {}}, from_above(1, 1.0), "poses: found");
  std::vector<double> wrong = poses;
  wrong[10] = 2;
  refused({"eye", lens(), "", {}}, wrong, "poses: environment 1: found");
  wrong[10] = std::numeric_limits<double>::quiet_NaN();
  refused({"eye", lens(), "", {}}, wrong, "poses: ");
  EXPECT_TRUE(scene.cameras().empty());
  scene.add_camera({"eye", lens(), "lift", {}}, tensor(poses));
  refused({"eye", lens(), "", {}}, poses, "name: found");
  EXPECT_THROW(scene.set_camera("nose", {}, tensor(poses)), data::InputError);
  EXPECT_THROW(scene.render("nose", {}, {}), data::InputError);
  const std::vector<int> none = {2};
  EXPECT_THROW(scene.render("eye", none, {}), data::InputError);
}

}  // namespace
}  // namespace flash::sim
