#include "apps/sim/scene_run.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/mesh/mesh_io.h"
#include "data/mesh/procedural_mesh.h"
#include "data/scene/scene.h"
#include "tests/apps/sim/scene_run_fixture.h"

namespace flash::sim {
namespace {

TEST_F(SceneRunTest, BadInputIsNamed) {
  const auto message = [&](const std::string& text) -> std::string {
    try {
      run_scene(data::load_scene(write("scene.json", text)), {}, out());
    } catch (const data::InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(message(R"({"schema": "flash-scene/1", "timestep": 0.01, "gravity": [0, 0, -9.81], "objects":
    {"cloth": {"asset": "cloth.json", "fixed": [{"vertices": [36]}]}}})")
                .find("vertex 36"),
            std::string::npos);
  EXPECT_NE(message(R"({"schema": "flash-scene/1", "timestep": 0.01, "gravity": [0, 0, -9.81], "objects":
    {"cloth": "cloth.json"}, "end_effectors": {"hand": {"keyframes": [{"t": 0, "translation": [0, 0, 1]}],
    "grasps": [{"from": 0}]}}})")
                .find("scene.json: end effector hand: grasps: no vertex of cloth within 0.01 m of its box at "
                      "0 s; the nearest is 0.99 m away"),
            std::string::npos);
}

TEST_F(SceneRunTest, KeyframesAfterTheEndAreWarnedOf) {
  const std::string path = write("scene.json", R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 2,
    "gravity": [0, 0, -9.81], "keyframes": [0.02, 0.03, 1], "objects": {"cloth": {"asset": "cloth.json"}}})");
  const SceneSummary summary = run_scene(data::load_scene(path), {}, out());
  EXPECT_EQ(summary.frames, 1);
  ASSERT_EQ(summary.warnings.size(), 1u);
  EXPECT_EQ(summary.warnings[0],
            "keyframes: 2 of 3 lie after the end at 0.02 s and are not written: is the duration right?");
}

TEST_F(SceneRunTest, AHandBelowTheTableAndAStartInsideItAreWarnedOf) {
  const std::string common =
      R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 5, "gravity": [0, 0, -9.81],
  "obstacles": {"table": {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}},)";
  const data::Scene below = data::load_scene(write("below.json", common + R"(
  "objects": {"cloth": {"asset": "cloth.json"}},
  "end_effectors": {"hand": {"size": [0.02, 0.02, 0.02],
    "keyframes": [{"t": 0, "translation": [0, 0, 0]}, {"t": 0.05, "translation": [0, 0, -0.08]}],
    "grasps": [{"object": "cloth"}]}}})"));
  const SceneSummary held = run_scene(below, {}, out());
  ASSERT_EQ(held.warnings.size(), 1u);
  EXPECT_NE(held.warnings[0].find("80 mm inside table at 0.05 s, where hand holds it"), std::string::npos)
      << held.warnings[0];
  EXPECT_NEAR(held.penetration_max, 0.08, 1e-9);
  EXPECT_EQ(column("log.csv", "substeps").back(), "1");

  const data::Scene inside = data::load_scene(write("inside.json", common + R"(
  "solver": {"exit_speed": 0.5},
  "objects": {"cloth": {"asset": "cloth.json", "start": {"T_base_object": [0, 0, -0.5, 0, 0, 0, 1]}}}})"));
  const SceneSummary started = run_scene(inside, {}, out());
  ASSERT_EQ(started.warnings.size(), 1u);
  EXPECT_NE(started.warnings[0].find("500 mm inside table at 0 s"), std::string::npos) << started.warnings[0];
  EXPECT_NEAR(started.penetration_max, 0.495, 1e-9);
  EXPECT_EQ(started.warnings[0].find("the sheet reached"), std::string::npos) << started.warnings[0];
}

TEST_F(SceneRunTest, ASheetThatIsLeftInsideIsSaid) {
  // Through a board, with an edge held on either side: every way out would tear it.
  const auto run = [&](double thickness) {
    const data::Scene scene = data::load_scene(write("board.json", R"({"schema": "flash-scene/1",
  "timestep": 0.01, "steps": 30, "gravity": [0, 0, 0],
  "obstacles": {"board": {"shape": "box", "size": [1, 1, )" + std::to_string(thickness) +
                                                                       R"(],
    "pose": [0, 0, 0.05, 0, 0, 0, 1]}},
  "objects": {"cloth": {"asset": "cloth.json",
    "start": {"T_base_object": [0, 0, 0, 0.70710678, 0, 0, 0.70710678]}}}})"));
    return run_scene(scene, {}, out());
  };
  const SceneSummary through = run(0.04);
  ASSERT_EQ(through.warnings.size(), 1u);
  EXPECT_NE(through.warnings[0].find("at the end it is still inside"), std::string::npos)
      << through.warnings[0];
  const SceneSummary whole = run(0.25);
  ASSERT_EQ(whole.warnings.size(), 1u);
  EXPECT_EQ(whole.warnings[0].find("still inside"), std::string::npos) << whole.warnings[0];
}

TEST_F(SceneRunTest, AnObstacleThatPassesBetweenVerticesIsSaidThoughItIsGoneAtTheEnd) {
  const data::Scene scene =
      data::load_scene(write("scene.json", R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 40,
      "gravity": [0, 0, -9.81], "objects": {"cloth": {"asset": "cloth.json",
        "start": {"T_base_object": [-0.05, -0.05, 0.01, 0, 0, 0, 1]}}},
      "obstacles": {"rod": {"shape": "capsule", "axis": [1, 0, 0], "point": [0, 0, -0.004], "half_length": 0.5, "radius": 0.004}}})"));
  const SceneSummary summary = run_scene(scene, {}, out());
  EXPECT_EQ(summary.penetration_max, 0);
  ASSERT_EQ(summary.warnings.size(), 1u);
  EXPECT_NE(summary.warnings[0].find("cloth: rod comes through between its vertices by "), std::string::npos)
      << summary.warnings[0];
}

TEST_F(SceneRunTest, HoldsThatNeverActOrContestAVertexAreWarnedOf) {
  const std::string head = R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 10, "gravity": [0, 0, 0],
  "keyframes": [], "objects": {"cloth": {"asset": "cloth.json")";
  const auto warnings = [&](const std::string& holds) {
    return run_scene(data::load_scene(write("holds.json", head + holds + "}}}")), {}, out()).warnings;
  };
  const std::string still = R"({"name": "a", "vertices": [0, 1],
    "keyframes": [{"t": 0, "translation": [0, 0, 0]}])";
  EXPECT_TRUE(warnings(R"(, "prescribed": [)" + still + "}]").empty());
  const std::vector<std::string> late = warnings(R"(, "prescribed": [)" + still + R"(, "from": 5}])");
  ASSERT_EQ(late.size(), 1u);
  EXPECT_NE(late[0].find("a never held anything: asked from 5 to inf s"), std::string::npos) << late[0];
  const std::vector<std::string> two = warnings(
      R"(, "fixed": [{"name": "bar", "vertices": [1]}], "prescribed": [)" + still + R"(, "from": 0.05}])");
  ASSERT_EQ(two.size(), 1u);
  EXPECT_NE(two[0].find("vertex 1 is held by bar and by a at 0.06 s; it obeys a"), std::string::npos)
      << two[0];
}

TEST_F(SceneRunTest, AQuasistaticRunWaitsForWhatIsStillToCome) {
  const data::Scene scene =
      data::load_scene(write("late.json", R"({"schema": "flash-scene/1", "timestep": 0.1,
  "steps": 40, "gravity": [0, 0, 0], "keyframes": [], "quasistatic": {"motion": 1e-6},
  "objects": {"cloth": {"asset": "cloth.json", "fixed": [{"vertices": [0, 6, 12, 18, 24, 30]}],
    "prescribed": [{"name": "pull", "vertices": [5, 11, 17, 23, 29, 35],
      "keyframes": [{"t": 0, "translation": [0, 0, 0]}, {"t": 1, "translation": [0, 0, 0]},
                    {"t": 2, "translation": [0.01, 0, 0]}]}]}}})"));
  const SceneSummary summary = run_scene(scene, {}, out());
  EXPECT_EQ(summary.at_rest, true);
  EXPECT_GE(summary.steps, 20);  // the pull begins after a second and takes another
}

TEST_F(SceneRunTest, AHandIsNoObstacleToWhatItHolds) {
  const data::Scene scene =
      data::load_scene(write("hand.json", R"({"schema": "flash-scene/1", "timestep": 0.01,
  "steps": 5, "gravity": [0, 0, -9.81], "objects": {"cloth": {"asset": "cloth.json"}},
  "end_effectors": {"hand, left": {"size": [0.02, 0.02, 0.02], "collides": true,
    "keyframes": [{"t": 0, "translation": [0, 0, 0]}, {"t": 0.05, "translation": [0, 0, 0.01]}],
    "grasps": [{"object": "cloth"}]}}})"));
  EXPECT_TRUE(run_scene(scene, {}, out()).warnings.empty());
  // A name with a comma is one field.
  EXPECT_NE(data::read_file(out() + "/forces.csv").find("\n0.01,\"hand, left\","), std::string::npos);
}

TEST_F(SceneRunTest, AFlatMeshThatCoversItselfIsSaid) {
  const auto notices_of = [&](const data::TriangleMesh& mesh) {
    data::save_triangle_mesh(mesh, (folder_ / "mesh.ply").string());
    write("sheet.json", R"({"schema": "flash-asset/1", "mesh": "mesh.ply", "element_type": "TRIANGLE",
      "mechanical_props": {"constitutive": "TRI_COROTATED", "areal_density": 0.2, "young": 100, "poisson": 0.3,
      "bending_rigidity": 1e-5, "bending_model": "hinge"}})");
    std::string all;
    for (const std::string& notice :
         run_scene(data::load_scene(write("scene.json", R"({"schema": "flash-scene/1", "timestep": 0.01,
      "steps": 1, "gravity": [0, 0, 0], "objects": {"cloth": {"asset": "sheet.json"}}})")),
                   {}, out())
             .notices)
      all += notice + "\n";
    return all;
  };
  data::TriangleMesh mesh = data::parse_mesh_spec("sheet:0.1x0.1:0.02", "", "");
  EXPECT_EQ(notices_of(mesh).find("cover each other"), std::string::npos);
  data::TriangleMesh curved = mesh;
  curved.vertices.row(7) << 0.05, 0.05, 0.01;
  EXPECT_EQ(notices_of(curved).find("cover each other"), std::string::npos);
  mesh.vertices.row(7) << 0.05, 0.05, 0;  // beyond its neighbours
  const std::string told = notices_of(mesh);
  EXPECT_NE(told.find("cloth: "), std::string::npos);
  EXPECT_NE(told.find(" cover each other at rest, though the mesh is flat"), std::string::npos) << told;
}

TEST_F(SceneRunTest, QuasistaticRunThatDoesNotComeToRestSaysSo) {
  const std::string path = write("scene.json", R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 3,
    "gravity": [0, 0, -9.81], "quasistatic": {"motion": 1e-9}, "objects": {"cloth": "cloth.json"}})");
  const SceneSummary summary = run_scene(data::load_scene(path), {}, out());
  EXPECT_EQ(summary.at_rest, false);
  EXPECT_NEAR(summary.last_motion, 9.81e-4, 1e-6);  // h^2 g: a free sheet never rests
}

}  // namespace
}  // namespace flash::sim
