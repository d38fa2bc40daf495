// Several environments of one scene.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "apps/sim/scene_run.h"
#include "data/files/error.h"
#include "data/scene/scene.h"
#include "tests/apps/sim/scene_run_fixture.h"

namespace flash::sim {
namespace {

namespace fs = std::filesystem;

std::string text_of(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

class SceneEnvironmentsTest : public SceneRunTest {
 protected:
  /// Two sheets that do not meet, one of which slides on a table.
  data::Scene sliding() {
    return data::load_scene(write("scene.json", R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 12,
      "gravity": [2, 0, -9.81], "objects": {"a": "cloth.json",
      "b": {"asset": "cloth.json", "start": {"T_base_object": [0, 0, 1, 0, 0, 0, 1]},
            "fixed": [{"vertices": [0, 5]}]}},
      "obstacles": {"table": {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}}})"));
  }
};

TEST_F(SceneEnvironmentsTest, TheFirstIsTheSceneToTheByte) {
  const data::Scene scene = sliding();
  run_scene(scene, {.contacts = true}, (folder_ / "alone").string());
  for (const int threads : {1, 3}) {
    const SceneSummary summary =
        run_scene(scene,
                  {.threads = threads,
                   .environments = 5,
                   .variations = parse_variations("bending=0.1:10:log,friction=0.1:0.5", "--vary"),
                   .contacts = true},
                  out());
    EXPECT_EQ(summary.environments, 5);
    EXPECT_EQ(summary.unusable_environments, 0);
    int compared = 0;
    for (const auto& entry : fs::recursive_directory_iterator(folder_ / "alone")) {
      if (!entry.is_regular_file()) continue;
      const fs::path same = fs::path(out()) / fs::relative(entry.path(), folder_ / "alone");
      EXPECT_TRUE(text_of(entry.path()) == text_of(same)) << same;
      ++compared;
    }
    EXPECT_EQ(compared, 13 + 12 + 3);  // frames, contacts, tables
  }
}

// The table's friction halves with 0.3 times 0.5: what slides then gains (2 - mu 9.81) h each step.
TEST_F(SceneEnvironmentsTest, OthersDifferAsTheyAreAsked) {
  run_scene(sliding(), {.environments = 4, .variations = {{"friction", 0.1, 0.5, false}}}, out());
  const std::vector<std::string> friction = column("environments.csv", "friction"),
                                 kinetic = column("environments.csv", "kinetic_J");
  EXPECT_EQ(friction[0], "1");
  EXPECT_EQ(column("environments.csv", "usable"), (std::vector<std::string>{"1", "1", "1", "1"}));
  // Of environment 0 the sheet on the table stays, and what the other one does is all there is.
  const double mass = 0.2 * 0.1 * 0.1;
  for (std::size_t e = 1; e < 4; ++e) {
    const double speed = (2 - 0.3 * std::stod(friction[e]) * 9.81) * 0.12;
    EXPECT_NEAR(std::stod(kinetic[e]) - std::stod(kinetic[0]), 0.5 * mass * speed * speed,
                0.02 * mass * speed * speed);  // until friction is whole a step goes by
  }
}

// The sheet stays where its friction is 0.3; with a tenth of it a gripper that comes later finds it gone.
TEST_F(SceneEnvironmentsTest, AGraspThatMissesLosesItsEnvironmentAlone) {
  const data::Scene scene = data::load_scene(write(
      "scene.json", R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 40, "gravity": [2, 0, -9.81],
      "objects": {"cloth": "cloth.json"}, "keyframes": [],
      "obstacles": {"table": {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}},
      "end_effectors": {"gripper": {"size": [0.02, 0.02, 0.02], "collides": false,
        "keyframes": [{"t": 0, "translation": [0, 0, 0]}], "grasps": [{"from": 0.3, "threshold": 0.001}]}}})"));
  const SceneSummary summary =
      run_scene(scene, {.environments = 3, .variations = {{"friction", 0.1, 0.11, false}}}, out());
  EXPECT_EQ(summary.unusable_environments, 2);
  EXPECT_EQ(summary.first_unusable.find("environment 1: end effector gripper: grasps: no vertex of cloth"),
            0u)
      << summary.first_unusable;
  EXPECT_EQ(summary.unconverged_steps, 0);
  EXPECT_EQ(column("environments.csv", "usable"), (std::vector<std::string>{"1", "0", "0"}));
  EXPECT_EQ(column("log.csv", "step").size(), 40u);
}

TEST_F(SceneEnvironmentsTest, WhatIsAskedInVainIsRefused) {
  try {
    write("cube.json",
          R"({"schema": "flash-asset/1", "mesh": "box:0.1x0.1x0.1:0.1", "element_type": "TETRAHEDRON",
      "mechanical_props": {"constitutive": "TET_NEOHOOKEAN", "density": 1000, "young": 1e5, "poisson": 0.3}})");
    const data::Scene solid =
        data::load_scene(write("solid.json", R"({"schema": "flash-scene/1", "timestep": 0.01,
      "steps": 1, "gravity": [0, 0, -9.81], "objects": {"cube": "cube.json"}})"));
    run_scene(solid, {.environments = 2, .variations = {{"bending", 0.5, 2, false}}}, out());
    ADD_FAILURE() << "not refused";
  } catch (const data::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("--vary bending: no object has it"), std::string::npos)
        << error.what();
  }
  EXPECT_FALSE(fs::exists(out()));
}

}  // namespace
}  // namespace flash::sim
