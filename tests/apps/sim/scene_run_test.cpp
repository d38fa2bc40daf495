#include "apps/sim/scene_run.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "data/asset/asset.h"
#include "data/asset/asset_mesh.h"
#include "data/mesh/mesh_io.h"
#include "data/scene/scene.h"
#include "sim/scene/scene.h"
#include "tests/apps/sim/scene_run_fixture.h"

namespace flash::sim {
namespace {

namespace fs = std::filesystem;

constexpr double weight = 0.2 * 0.01 * 9.81;  // of the cloth in cloth.json [N]

TEST_F(SceneRunTest, RestingSheetIsCarriedByTheTable) {
  const std::string path = write("scene.json", R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 5,
    "gravity": [0, 0, -9.81], "objects": {"cloth": {"asset": "cloth.json",
    "start": {"T_base_object": [0.1, 0.2, 0.3, 0, 0, 0, 1]}}},
    "obstacles": {"table": {"shape": "plane", "point": [0, 0, 0.3], "normal": [0, 0, 1]}}})");
  const SceneSummary summary = run_scene(data::load_scene(path), {}, out());
  EXPECT_EQ(summary.steps, 5);
  EXPECT_EQ(summary.unconverged_steps, 0);
  EXPECT_EQ(summary.at_rest, std::nullopt);  // it is asked of quasistatic scenes alone
  EXPECT_EQ(summary.frames, 6);
  EXPECT_EQ(column("log.csv", "step"), (std::vector<std::string>{"1", "2", "3", "4", "5"}));
  for (const std::string& body : column("forces.csv", "body")) EXPECT_EQ(body, "table");
  for (const std::string& fz : column("forces.csv", "fz"))
    EXPECT_NEAR(std::stod(fz), weight, 1e-3 * weight);  // the tolerance on the residual
  const data::TriangleMesh last = data::load_triangle_mesh(out() + "/frames/000005.ply");
  EXPECT_EQ(last.vertices.rows(), 36);
  EXPECT_EQ(last.triangles.rows(), 50);
  EXPECT_NEAR(last.vertices.col(2).minCoeff(), 0.3, 1e-9);
  EXPECT_NEAR(last.vertices.col(0).minCoeff(), 0.1, 1e-9);
}

TEST_F(SceneRunTest, FallingSheetObeysTheDiscreteLawAndKeyframesAreChosen) {
  const std::string path =
      write("scene.json", R"({"schema": "flash-scene/1", "timestep": 0.01, "duration": 0.1,
    "gravity": [0, -9.81, 0], "keyframes": [0.05, 0.1],
    "objects": {"cloth": {"asset": "cloth.json", "velocity": [1, 0, 0]}}})");
  const SceneSummary summary = run_scene(data::load_scene(path), {}, out());
  EXPECT_EQ(summary.frames, 2);
  EXPECT_FALSE(fs::exists(out() + "/frames/000000.ply"));
  const data::TriangleMesh last = data::load_triangle_mesh(out() + "/frames/000010.ply");
  // n (n + 1)/2 h^2 g; the residual may leave 1e-3 of a step's h^2 g.
  EXPECT_NEAR(last.vertices.col(1).minCoeff(), -9.81 * 1e-4 * 55, 9.81 * 1e-4 * 1e-2);
  EXPECT_NEAR(last.vertices.col(0).minCoeff(), 0.1, 1e-6);
}

TEST_F(SceneRunTest, EndEffectorLiftsWhatIsNearItAndReadsTheWeight) {
  const std::string path = write("scene.json", R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 150,
    "gravity": [0, 0, -9.81], "objects": {"cloth": "cloth.json"},
    "solver": {"tolerance": 1e-4},
    "end_effectors": {"gripper": {"size": [0.2, 0.02, 0.02],
      "keyframes": [{"t": 0, "translation": [0.05, 0.1, 0]}, {"t": 1, "translation": [0.05, 0.1, 0]},
                    {"t": 1.5, "translation": [0.05, 0.1, 0]}],
      "grasps": [{"from": 0, "threshold": 0.001}]}}, "keyframes": [1.5]})");
  const data::Scene scene = data::load_scene(path);
  const SceneSummary summary = run_scene(scene, {}, out());
  EXPECT_EQ(summary.unconverged_steps, 0);
  // Held along the edge y = 0.1 the sheet swings; its mean pull over two swings is near the weight.
  double mean = 0;
  const std::vector<std::string> fz = column("forces.csv", "fz");
  ASSERT_EQ(fz.size(), 150u);
  for (const std::string& value : fz) mean += std::stod(value) / 150;
  EXPECT_NEAR(mean, weight, 0.3 * weight);
  const data::TriangleMesh last = data::load_triangle_mesh(out() + "/frames/000150.ply");
  for (int i = 30; i < 36; ++i) EXPECT_NEAR(last.vertices(i, 2), 0.0, 1e-9);
  EXPECT_LT(last.vertices.col(2).minCoeff(), -0.05);
}

TEST_F(SceneRunTest, PrescribedVerticesFollowTheirKeyframes) {
  const std::string path = write("scene.json", R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 20,
    "gravity": [0, 0, 0], "keyframes": [0.2], "objects": {"cloth": {"asset": "cloth.json",
    "prescribed": [{"vertices": [0, 5], "keyframes": [{"t": 0, "translation": [1, 1, 1]},
                                                      {"t": 0.2, "translation": [1, 1, 1.02]}]}],
    "fixed": [{"vertices": [30, 35]}], "loads": [{"vertices": [12], "force": [0, 0, 0.001]}]}}})");
  run_scene(data::load_scene(path), {}, out());
  const data::TriangleMesh last = data::load_triangle_mesh(out() + "/frames/000020.ply");
  EXPECT_LT((last.vertices.row(0) - Eigen::RowVector3d(0, 0, 0.02)).norm(), 1e-9);
  EXPECT_LT((last.vertices.row(5) - Eigen::RowVector3d(0.1, 0, 0.02)).norm(), 1e-9);
  EXPECT_LT((last.vertices.row(30) - Eigen::RowVector3d(0, 0.1, 0)).norm(), 1e-9);
}

// Uniaxial tension of the corotational sheet is exact: T = E t (s - 1) on each end, width 1 - nu (s - 1).
TEST_F(SceneRunTest, QuasistaticPullComesToRestWithTheForceOnEachSupport) {
  const std::string path = write("scene.json", R"({"schema": "flash-scene/1", "timestep": 1, "steps": 50,
    "gravity": [0, 0, 0], "keyframes": [], "solver": {"tolerance": 1e-9}, "quasistatic": {"motion": 1e-9},
    "objects": {"cloth": {"asset": "cloth.json", "fixed": [
      {"name": "left", "vertices": [0, 6, 12, 18, 24, 30], "axes": "x"},
      {"name": "right", "vertices": [5, 11, 17, 23, 29, 35], "axes": "x", "over": 5, "positions":
        [[0.11, 0, 0], [0.11, 0, 0], [0.11, 0, 0], [0.11, 0, 0], [0.11, 0, 0], [0.11, 0, 0]]},
      {"name": "corner", "vertices": [0], "axes": "y"}, {"name": "floor", "vertices": "all", "axes": "z"}]}}})");
  const SceneSummary summary = run_scene(data::load_scene(path), {}, out());
  EXPECT_EQ(summary.at_rest, true);
  EXPECT_LE(summary.last_motion, 1e-9);
  EXPECT_GT(summary.steps, 5);  // the supports take five
  EXPECT_LT(summary.steps, 50);
  std::map<std::string, double> fx;
  const std::vector<std::string> body = column("forces.csv", "body"), force = column("forces.csv", "fx");
  for (std::size_t i = 0; i < body.size(); ++i) fx[body[i]] = std::stod(force[i]);
  EXPECT_NEAR(fx.at("right"), 100 * 0.1 * 0.1, 1e-8);  // E t, strain, width
  EXPECT_NEAR(fx.at("left"), -1.0, 1e-8);
  EXPECT_NEAR(fx.at("corner"), 0, 1e-12);
  EXPECT_EQ(fx.at("floor"), 0);
  char last[32];
  std::snprintf(last, sizeof last, "/frames/%06d.ply", summary.steps);
  const data::TriangleMesh mesh = data::load_triangle_mesh(out() + last);
  EXPECT_NEAR(mesh.vertices(35, 0), 0.11, 1e-12);
  EXPECT_NEAR(mesh.vertices(35, 1), 0.1 * (1 - 0.3 * 0.1), 1e-9);
  const double energy = std::stod(column("log.csv", "membrane_J").back());
  EXPECT_NEAR(energy, 0.5 * 100 * 0.1 * 0.1 * 0.01, 1e-9);  // E t strain^2 / 2 times the area
}

// A woven strip is pulled along the x of its mesh, and another hangs over by its own weight: both wherever
// the asset turns the mesh to.
TEST_F(SceneRunTest, TheWarpTurnsWithTheMeshOfAnAsset) {
  const auto end_of_strip = [&](const std::string& rotation, const Eigen::Vector3d& gravity,
                                const std::string& held) {
    write("woven.json",
          R"({"schema": "flash-asset/1", "mesh": "sheet:0.1x0.04:0.02", "element_type": "TRIANGLE",
      "transformation": {"trans": [0, 0, 0], "rotation": )" +
              rotation + R"(}, "mechanical_props": {"constitutive": "TRI_STVK",
      "areal_density": 0.2, "young": 500, "young_ratio": 0.4, "shear_ratio": 0.5, "warp_direction": 20, "poisson": 0.2,
      "bending_rigidity": 1e-3, "bending_ratio": 0.3, "twisting_ratio": 0.6}})");
    std::ostringstream text;
    text << R"({"schema": "flash-scene/1", "timestep": 0.5, "steps": 20, "solver": {"tolerance": 1e-8},
      "gravity": [)"
         << gravity.x() << ", " << gravity.y() << ", " << gravity.z() << R"(], "objects": {"strip": {
      "asset": "woven.json", "fixed": [{"vertices": )"
         << held << "}]}}}";
    run_scene(data::load_scene(write("scene.json", text.str())), {}, out());
    const data::TriangleMesh end = data::load_triangle_mesh(out() + "/frames/000020.ply");
    return Eigen::Vector3d(end.vertices.row(11));
  };
  const Eigen::Vector3d pull(100, 0, 0), fall(0, 0, -0.3);
  const char *edge = "[0, 6, 12]", *clamp = "[0, 1, 6, 7, 12, 13]";
  const Eigen::Vector3d pulled = end_of_strip("[0, 0, 0]", pull, edge),
                        hanging = end_of_strip("[0, 0, 0]", fall, clamp);
  EXPECT_GT(pulled.x(), 0.1001);
  EXPECT_LT(hanging.z(), -1e-4);
  for (const Eigen::Vector3d& degrees :
       {Eigen::Vector3d(0, 0, 90), Eigen::Vector3d(0, 90, 0), Eigen::Vector3d(20, -35, 130)}) {
    std::ostringstream rotation;
    rotation << "[" << degrees.x() << ", " << degrees.y() << ", " << degrees.z() << "]";
    const Eigen::Matrix3d turn = data::rotation_from_degrees(degrees);
    EXPECT_LT((end_of_strip(rotation.str(), turn * pull, edge) - turn * pulled).norm(), 1e-7) << degrees;
    EXPECT_LT((end_of_strip(rotation.str(), turn * fall, clamp) - turn * hanging).norm(), 1e-7) << degrees;
  }
}

TEST_F(SceneRunTest, PublishedSceneRunsAsItStands) {
  write("published.json", R"({"mesh": "towel.obj", "element_type": "TRIANGLE",
    "transformation": {"trans": [0, 1, 0], "rotation": [0, 0, 0]},
    "mechanical_props": {"obj_mass": 0.9, "young": 3E+4, "poisson": 0.4, "constitutive": "TRI_ARAP", "bending": 0.2}})");
  write("towel.obj", "v 0 0 0\nv 1 0 0\nv 0 0 1\nv 3 0 0\nf 1 2 3\nf 3 2 4\n");
  const std::string path = write("scene.json", R"({"timestep": 0.01, "gravity": [0, -9.81, 0],
    "linearsolver": {"type": "SPARSE_INVERSE_CUDA"},
    "constraintsolver": {"type": "LiteNonSmoothNewton_CUDA", "maxforce": 1E+10, "iterations": 10, "tolerance": 1E-9},
    "planecollisions": {"point": [0, 0, 0], "normal": [0, 1, 0], "friction": 0.5}, "objects": {"cloth": "published.json"}})");
  const data::Scene scene = data::load_scene(path);
  std::vector<std::string> notices;
  const std::vector<SceneBody> bodies = scene_bodies(scene, 2, notices);
  ASSERT_EQ(bodies.size(), 1u);
  const Environment& environment = bodies[0].environment;
  EXPECT_EQ(environment.materials[0].constitutive, data::Constitutive::tri_arap);
  EXPECT_EQ(environment.materials[0].membrane_stiffness, 3e4);
  EXPECT_NEAR(environment.materials[0].bending_rigidity, 0.6, 1e-12);
  const Eigen::VectorXd mass = environment.materials[0].areal_density * bodies[0].sheet.vertex_area;
  EXPECT_LT((mass.array() - 0.225).abs().maxCoeff(), 1e-12);  // evenly over four vertices
  EXPECT_EQ(environment.obstacles.size(), 1u);
  EXPECT_EQ(environment.obstacles[0].friction, (std::vector{0.5}));
  EXPECT_NEAR(environment.state.positions(0, 1), 1.0, 1e-15);
  EXPECT_FALSE(notices.empty());
  SceneRun run;
  run.steps = 2;
  EXPECT_EQ(run_scene(scene, run, out()).steps, 2);
}

TEST_F(SceneRunTest, StoppedRunKeepsWhatItDid) {
  const std::string path = write("scene.json", R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 50,
    "gravity": [0, 0, -9.81], "objects": {"cloth": "cloth.json", "other": "cloth.json"}})");
  SceneRun run;
  run.threads = 2;
  run.progress = [](int done, int) { return done < 3; };
  const SceneSummary summary = run_scene(data::load_scene(path), run, out());
  EXPECT_TRUE(summary.interrupted);
  EXPECT_EQ(summary.steps, 3);
  EXPECT_EQ(column("log.csv", "step").size(), 3u);
  EXPECT_EQ(data::load_triangle_mesh(out() + "/frames/000003.ply").vertices.rows(), 72);
}

// Its frames and its tables are of one run at every moment.
TEST_F(SceneRunTest, FirstFrameOfARunFindsNothingOfAFormerOne) {
  const std::string scene = write("scene.json", R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 5,
    "gravity": [0, 0, -9.81], "objects": {"cloth": "cloth.json"}})");
  run_scene(data::load_scene(scene), {}, out());
  EXPECT_EQ(column("log.csv", "step").size(), 5u);
  int looked = 0;
  SceneRun again;
  again.progress = [&](int done, int) {
    if (done == 5) return true;
    ++looked;  // the first step may refuse the scene, and then nothing is lost
    for (const char* file : {"log.csv", "forces.csv", "frames/000005.ply"})
      EXPECT_EQ(fs::exists(fs::path(out()) / file), done == 0) << file << " after step " << done;
    return true;
  };
  run_scene(data::load_scene(scene), again, out());
  EXPECT_EQ(looked, 5);
}

}  // namespace
}  // namespace flash::sim
