#include "apps/scene_run.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "data/asset.h"
#include "data/atomic_file.h"
#include "data/error.h"
#include "data/mesh_io.h"
#include "data/procedural_mesh.h"
#include "data/scene.h"
#include "sim/scene/scene.h"

namespace flash::sim {
namespace {

namespace fs = std::filesystem;

class SceneRunTest : public testing::Test {
 protected:
  SceneRunTest()
      : folder_(
            fs::temp_directory_path() /
            ("flash_scene_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()))) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    write("cloth.json",
          R"({"schema": "flash-asset/1", "mesh": "sheet:0.1x0.1:0.02", "element_type": "TRIANGLE",
      "mechanical_props": {"constitutive": "TRI_COROTATED", "areal_density": 0.2, "young": 100, "poisson": 0.3, "bending_rigidity": 1e-5,
      "friction": 0.3}})");
  }
  ~SceneRunTest() override { fs::remove_all(folder_); }

  std::string write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  std::string out() const { return (folder_ / "out").string(); }

  // The named column of a CSV as text, one entry a row.
  std::vector<std::string> column(const std::string& file, const std::string& name) const {
    std::ifstream in(fs::path(out()) / file);
    std::vector<std::string> values;
    std::size_t index = 0;
    for (std::string line; std::getline(in, line);) {
      std::vector<std::string> words;
      std::istringstream stream(line);
      for (std::string word; std::getline(stream, word, ',');) words.push_back(word);
      if (values.empty()) index = std::find(words.begin(), words.end(), name) - words.begin();
      values.push_back(words.at(index));
    }
    values.erase(values.begin());
    return values;
  }

  fs::path folder_;
};

constexpr double weight = 0.2 * 0.01 * 9.81;  // of the cloth in cloth.json [N]

constexpr const char* two_sheets = R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 20,
    "gravity": [0, 0, -9.81], "self_contact": {"thickness": 2e-3, "friction": 0.4},
    "objects": {"lower": {"asset": "cloth.json"},
      "upper": {"asset": "cloth.json", "start": {"T_base_object": [0.01, 0.003, HEIGHT, 0, 0, 0, 1]},
                "fixed": [{"name": "pin", "vertices": [0], "axes": "xy"}]}},
    "obstacles": {"table": {"shape": "plane", "normal": [0, 0, 1]}}})";

std::string with_height(const std::string& height) {
  std::string text = two_sheets;
  return text.replace(text.find("HEIGHT"), 6, height);
}

TEST_F(SceneRunTest, ObjectsThatMeetLieOnEachOther) {
  const SceneSummary summary =
      run_scene(data::load_scene(write("scene.json", with_height("0.0021"))), {}, out());
  EXPECT_EQ(summary.unconverged_steps, 0);
  EXPECT_GT(summary.layer_touches_max, 10);
  EXPECT_GT(summary.layer_distance_min, 0.9 * 2e-3);
  EXPECT_LT(summary.layer_distance_min, 2e-3);
  for (const char* name : {"layer_distance_m", "layer_touches", "layer_pairs", "layers_J"})
    EXPECT_EQ(column("log.csv", name).size(), 20u);
  EXPECT_GT(std::stod(column("log.csv", "layer_touches").back()), 10);
  // The table carries both, and the pin that is left in one of its axes carries neither.
  double carried = 0;
  const std::vector<std::string> bodies = column("forces.csv", "body"), up = column("forces.csv", "fz");
  for (std::size_t k = bodies.size() - 2; k < bodies.size(); ++k)
    if (bodies[k] == "table") carried = std::stod(up[k]);
  EXPECT_NEAR(carried, 2 * weight, 2e-2 * weight);
  const data::TriangleMesh end = data::load_triangle_mesh((fs::path(out()) / "frames/000020.ply").string());
  EXPECT_NEAR(end.vertices.bottomRows(36).col(2).mean(), 2e-3, 1e-4);
}

TEST_F(SceneRunTest, StartThatPassesThroughItselfIsRefused) {
  // The lower one is flat; the upper one stands on edge in the middle of it.
  const std::string path = write("scene.json", R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 2,
    "gravity": [0, 0, -9.81], "self_contact": {}, "objects": {"lower": {"asset": "cloth.json"},
      "upper": {"asset": "cloth.json", "start": {"T_base_object": [0.005, 0.049, -0.05, 0.7071067811865476, 0, 0, 0.7071067811865476]}}}})");
  try {
    run_scene(data::load_scene(path), {}, out());
    FAIL() << "it has to be refused";
  } catch (const data::InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find(" of lower passing through triangle "), std::string::npos) << text;
    EXPECT_NE(text.find(" of upper"), std::string::npos) << text;
  }
  EXPECT_FALSE(fs::exists(out()));
}

TEST_F(SceneRunTest, LayersThatStartInOnePlaceAreRefused) {
  const auto scene = [&](const std::string& upper) {
    return data::load_scene(write("scene.json", R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 2,
    "gravity": [0, 0, -9.81], "self_contact": {}, "objects": {"lower": {"asset": "cloth.json", "fixed": [{"vertices": "all"}]},
      "upper": {"asset": "cloth.json")" + upper + "}}}"));
  };
  for (const char* upper : {"", R"(, "start": {"T_base_object": [0.033, 0.007, 1e-12, 0, 0, 0, 1]})"}) try {
      run_scene(scene(upper), {}, out());
      FAIL() << "it has to be refused";
    } catch (const data::InputError& error) {
      const std::string text = error.what();
      EXPECT_NE(text.find(" of lower"), std::string::npos) << text;
      EXPECT_NE(text.find(" of upper"), std::string::npos) << text;
      EXPECT_NE(text.find("start them a thickness apart"), std::string::npos) << text;
    }
  EXPECT_FALSE(fs::exists(out()));
  // What holds carry whole has no say in it.
  EXPECT_EQ(run_scene(scene(R"(, "fixed": [{"vertices": "all"}])"), {}, out()).unconverged_steps, 0);
}

TEST_F(SceneRunTest, AnObjectWhollyInsideASolidIsRefused) {
  write("block.json",
        R"({"schema": "flash-asset/1", "mesh": "box:0.06x0.06x0.06:0.02", "element_type": "TETRAHEDRON",
      "mechanical_props": {"constitutive": "TET_NEOHOOKEAN", "density": 300, "young": 3e4, "poisson": 0.3}})");
  write("small.json",
        R"({"schema": "flash-asset/1", "mesh": "sheet:0.02x0.02:0.01", "element_type": "TRIANGLE",
      "mechanical_props": {"constitutive": "TRI_COROTATED", "areal_density": 0.2, "young": 100, "poisson": 0.3,
      "bending_rigidity": 1e-5}})");
  const auto run = [&](const std::string& small) {
    return run_scene(
        data::load_scene(write("scene.json", R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 1,
      "gravity": [0, 0, 0], "self_contact": {}, "objects": {"block": {"asset": "block.json"},
      "small": {"asset": "small.json", "start": {"T_base_object": [)" +
                                                 small + R"(, 0, 0, 0, 1]}}}})")),
        {}, out());
  };
  for (const char* place : {"0.02, 0.02, 0.03", "0.001, 0.001, 0.05"}) try {
      run(place);
      FAIL() << "it has to be refused";
    } catch (const data::InputError& error) {
      EXPECT_NE(std::string(error.what()).find("found small wholly inside block"), std::string::npos)
          << error.what();
    }
  for (const char* place : {"0.02, 0.02, 0.07", "-0.03, 0.02, 0.03", "0.02, 0.02, -0.01"})
    EXPECT_EQ(run(place).steps, 1) << place;
}

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
                .find("the nearest is 0.99 m away"),
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

/// A box of tetrahedra on a table, from files.
std::string box_scene(const std::string& poisson, const std::string& solver, const std::string& start) {
  return R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 20, "gravity": [0, 0, -9.81],
    "solver": {"type": ")" +
         solver + R"("}, "obstacles": {"table": {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}},
    "objects": {"box": {"asset": "box)" +
         poisson + R"(.json")" + start + "}}}";
}

TEST_F(SceneRunTest, SolidsRunFromFilesAndTellWhereTheyLock) {
  data::save_tet_mesh(data::tet_box({0.04, 0.04, 0.04}, {2, 2, 2}), (folder_ / "box.tet").string());
  for (const char* poisson : {"0.3", "0.45"})
    write(std::string("box") + poisson + ".json",
          std::string(R"({"schema": "flash-asset/1", "mesh": "box.tet", "element_type": "TETRAHEDRON",
      "mechanical_props": {"constitutive": "TET_NEOHOOKEAN", "density": 300, "young": 3e4, "stiffness_damping": 0.02,
      "poisson": )") +
              poisson + "}}");
  const auto run = [&](const std::string& poisson) {
    const data::Scene scene = data::load_scene(write("scene.json", box_scene(poisson, "newton", "")));
    return run_scene(scene, {}, out());
  };
  const SceneSummary soft = run("0.3");
  EXPECT_TRUE(soft.warnings.empty());
  EXPECT_EQ(soft.unconverged_steps, 0);
  // It carries its weight, 300 kg/m^3 of 64 cm^3, once it has come to rest; its frames show its surface.
  EXPECT_NEAR(std::stod(column("forces.csv", "fz").back()), 300 * 6.4e-5 * 9.81, 1e-3);
  const data::Geometry frame = data::load_geometry((fs::path(out()) / "frames" / "000020.ply").string());
  EXPECT_EQ(frame.points.rows(), 27);
  EXPECT_EQ(frame.triangles.rows(), 6 * 4 * 2);
  EXPECT_GT(std::stod(column("log.csv", "elastic_J").back()), 0);
  const SceneSummary locking = run("0.45");
  ASSERT_EQ(locking.warnings.size(), 1u);
  EXPECT_NE(locking.warnings[0].find("box: linear tetrahedra lock at nu = 0.45, from 0.4 on"),
            std::string::npos);
}

// The mesh is made on the spot; vertices count as it numbers them, and what holds a face holds the vertices
// in the middle of its edges, at rest and where it is moved to.
TEST_F(SceneRunTest, ASolidThatCollapsesToAPointIsNamed) {
  const data::TetMesh mesh = data::tet_box({0.04, 0.04, 0.04}, {2, 2, 2});
  data::save_point_cloud(0.05 * mesh.vertices, (folder_ / "start.ply").string());
  const auto run = [&](const std::string& law, const std::string& order) {
    write("block.json", R"({"schema": "flash-asset/1", "mesh": "box:0.04x0.04x0.04:0.02",
      "element_type": "TETRAHEDRON", "element_order": )" +
                            order + R"(, "mechanical_props": {"constitutive": ")" + law +
                            R"(", "density": 300, "young": 3e4, "poisson": 0}})");
    return run_scene(
        data::load_scene(write("scene.json", R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 30,
      "gravity": [0, 0, 0], "objects": {"block": {"asset": "block.json", "start": {"mesh": "start.ply"}}}})")),
        {}, out());
  };
  for (const char* order : {"1", "2"}) {
    const SceneSummary collapsed = run("TET_NEOHOOKEAN", order);
    EXPECT_EQ(collapsed.collapsed_elements, 40);
    ASSERT_EQ(collapsed.warnings.size(), 1u);
    const std::string& warning = collapsed.warnings[0];
    EXPECT_TRUE(
        warning.starts_with("block: 40 of 40 tetrahedra have less than 0.001 of their rest volume at "))
        << warning;
    EXPECT_NE(warning.find(" s, and 40 at the end: "), std::string::npos) << warning;
    EXPECT_NE(warning.find("take TET_NEOHOOKEAN_LOG"), std::string::npos) << warning;
    const SceneSummary back = run("TET_NEOHOOKEAN_LOG", order);
    EXPECT_TRUE(back.warnings.empty());
    EXPECT_EQ(back.collapsed_elements, 0);
  }
}

TEST_F(SceneRunTest, QuadraticSolidsAreHeldByTheVerticesOfTheirMesh) {
  write("box.json", R"({"schema": "flash-asset/1", "mesh": "box:0.04x0.02x0.02:0.02",
      "element_type": "TETRAHEDRON", "element_order": 2, "mechanical_props": {"constitutive": "TET_NEOHOOKEAN",
      "density": 300, "young": 3e4, "poisson": 0.45}})");
  const auto scene = [](const std::string& vertex) {
    return R"({"schema": "flash-scene/1", "timestep": 1, "steps": 30, "gravity": [0, 0, 0], "keyframes": [],
      "solver": {"tolerance": 1e-8}, "quasistatic": {"motion": 1e-10}, "objects": {"box": {"asset": "box.json",
      "fixed": [{"name": "left", "vertices": [0, 3, 6, 9], "axes": "x"}, {"name": "y", "vertices": [0, 3], "axes": "y"},
        {"name": "z", "vertices": [0], "axes": "z"},
        {"name": "right", "axes": "x", "vertices": [2, 5, 8, )" +
           vertex + R"(], "positions":
          [[0.0402, 0, 0], [0.0402, 0, 0], [0.0402, 0, 0], [0.0402, 0, 0]]}]}}})";
  };
  const SceneSummary summary = run_scene(data::load_scene(write("scene.json", scene("11"))), {}, out());
  EXPECT_TRUE(summary.warnings.empty());
  EXPECT_EQ(summary.at_rest, true);
  // A bar pulled by half a per cent: E, strain and section, but for terms of the law of its square.
  const std::vector<std::string> body = column("forces.csv", "body"), fx = column("forces.csv", "fx");
  const auto right = std::find(body.rbegin(), body.rend(), "right") - body.rbegin();
  ASSERT_LT(right, static_cast<long>(body.size()));
  EXPECT_NEAR(std::stod(*(fx.rbegin() + right)), 3e4 * 0.005 * 4e-4, 0.02 * 3e4 * 0.005 * 4e-4);
  try {
    run_scene(data::load_scene(write("scene.json", scene("12"))), {}, out());
    ADD_FAILURE();
  } catch (const data::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("vertex 12, expected 0 to 11"), std::string::npos);
  }
}

TEST_F(SceneRunTest, SolidsThatCannotBeAreNamed) {
  data::TetMesh mesh = data::tet_box({0.04, 0.04, 0.04}, {1, 1, 1});
  data::save_tet_mesh(mesh, (folder_ / "box.tet").string());
  mesh.vertices.col(2) *= -1;
  data::save_point_cloud(mesh.vertices, (folder_ / "start.ply").string());
  write("box0.3.json", R"({"schema": "flash-asset/1", "mesh": "box.tet", "element_type": "TETRAHEDRON",
      "mechanical_props": {"constitutive": "TET_COROTATED", "density": 300, "young": 3e4, "poisson": 0.3}})");
  const auto message = [&](const std::string& text) -> std::string {
    try {
      run_scene(data::load_scene(write("scene.json", text)), {}, out());
    } catch (const data::InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(message(box_scene("0.3", "newton", R"(, "start": {"mesh": "start.ply"})"))
                .find("objects.box.start: turns tetrahedron 0 of "),
            std::string::npos);
  EXPECT_EQ(
      message(box_scene("0.3", "projective", "")),
      "solver.type projective: box is a solid (element_type TETRAHEDRON), which type newton simulates alone");
  EXPECT_FALSE(fs::exists(fs::path(out()) / "log.csv"));
}

/// The example of the documents with cells of 55 mm in place of 25: it takes a tenth of the time.
TEST_F(SceneRunTest, AClothThatFallsOverAChairComesToRestOutsideOfIt) {
  const fs::path examples = FLASH_EXAMPLES;
  const auto read = [&](const char* name) {
    std::ifstream in(examples / name);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  const auto replaced = [](std::string text, const std::string& old, const std::string& by) {
    EXPECT_NE(text.find(old), std::string::npos) << old;
    return text.replace(text.find(old), old.size(), by);
  };
  write("chair.obj", read("chair.obj"));
  write("blanket.json", replaced(read("blanket.json"), "1.1x1.1:0.025", "1.1x1.1:0.055"));
  const std::string path = write("scene.json", read("chair.json"));
  const SceneSummary summary = run_scene(data::load_scene(path), {}, out());
  EXPECT_EQ(summary.steps, 500);
  EXPECT_EQ(summary.unconverged_steps, 0);
  EXPECT_LT(summary.penetration_max, 1e-9);
  EXPECT_EQ(summary.start_penetration_max, 0);
  // At rest the chair carries all of it: to a thousandth of the weight a vertex, and what still swings.
  const double carried = 0.25 * 1.1 * 1.1 * 9.81;
  const std::vector<std::string> bodies = column("forces.csv", "body"), forces = column("forces.csv", "fz");
  double last = 0;
  for (std::size_t k = bodies.size() - 2; k < bodies.size(); ++k) last += std::stod(forces[k]);
  EXPECT_NEAR(last, carried, 1e-2 * carried);
  EXPECT_LT(std::stod(column("log.csv", "kinetic_J").back()), 1e-4);  // of 3 J that it fell with
  const data::TriangleMesh lies = data::load_triangle_mesh(out() + "/frames/000500.ply");
  EXPECT_GT(lies.vertices.col(2).maxCoeff(), 0.85);  // on the back of the chair
}

TEST_F(SceneRunTest, MeshesOfObstaclesAreReadAndBadOnesNamed) {
  write("wedge.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  write("fin.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n");
  const auto run = [&](const std::string& obstacle) {
    const std::string path = write("scene.json", R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 1,
      "gravity": [0, 0, -9.81], "objects": {"cloth": {"asset": "cloth.json",
      "start": {"T_base_object": [0, 0, 2, 0, 0, 0, 1]}}}, "obstacles": {"thing": )" +
                                                     obstacle + "}}");
    return run_scene(data::load_scene(path), {}, out());
  };
  const auto said = [&](const std::string& obstacle) {
    for (const std::string& notice : run(obstacle).notices)
      if (notice.starts_with("thing: ")) return notice;
    return std::string();
  };
  EXPECT_EQ(said(R"({"shape": "mesh", "file": "wedge.obj", "scale": 0.1, "pose": [0, 0, 1, 0, 0, 0, 1]})"),
            "thing: a closed surface of 4 triangles, 0.1 x 0.1 x 0.1 m");
  EXPECT_EQ(said(R"({"shape": "mesh", "file": "open.obj"})"),
            "thing: an open surface of 1 triangles, 1 x 1 x 0 m, met 0.5 mm off its triangles on both sides");
  EXPECT_NE(said(R"({"shape": "mesh", "file": "wedge.obj", "scale": 100, "pose": [0, 0, -200, 0, 0, 0, 1]})")
                .find("is it in millimetres?"),
            std::string::npos);
  const auto refused = [&](const std::string& obstacle) {
    try {
      run(obstacle);
    } catch (const data::InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(refused(R"({"shape": "mesh", "file": "open.obj", "margin": 0})")
                .find("obstacles.thing.margin: found 0, expected a length above 0"),
            std::string::npos);
  EXPECT_NE(refused(R"({"shape": "mesh", "file": "fin.obj"})")
                .find("triangle 1: runs from vertex 0 to 1 as triangle 0"),
            std::string::npos);
  EXPECT_NE(refused(R"({"shape": "mesh", "file": "no.obj"})").find("no.obj does not exist"),
            std::string::npos);
  EXPECT_NE(refused(R"({"shape": "mesh", "file": "wedge.obj", "scale": 0})")
                .find("obstacles.thing.scale: found 0, expected a number above 0"),
            std::string::npos);
  EXPECT_NE(
      refused(R"({"shape": "mesh", "file": "wedge.obj", "size": 1})").find("obstacles.thing.size: unknown"),
      std::string::npos);
}

/// A block that reaches 1 mm into the table: one that stands on it exactly may pass over what lies there.
TEST_F(SceneRunTest, AMeshMovesAlongItsTrajectory) {
  write("block.obj",
        "v -1 -1 -1\nv 1 -1 -1\nv -1 1 -1\nv 1 1 -1\nv -1 -1 1\nv 1 -1 1\nv -1 1 1\nv 1 1 1\n"
        "f 1 3 4\nf 1 4 2\nf 5 6 8\nf 5 8 7\nf 1 2 6\nf 1 6 5\nf 3 7 8\nf 3 8 4\nf 1 5 7\nf 1 7 3\n"
        "f 2 4 8\nf 2 8 6\n");
  // A block of 2 cm that pushes a sheet of 10 cm along a table, from 1 mm before it, at 10 cm/s.
  const std::string path = write("scene.json", R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 50,
    "gravity": [0, 0, -9.81], "keyframes": [0.5], "objects": {"cloth": {"asset": "cloth.json"}},
    "obstacles": {"table": {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1], "friction": 0.1},
      "block": {"shape": "mesh", "file": "block.obj", "scale": 0.1, "friction": 0, "keyframes": [
        {"t": 0, "translation": [-0.101, 0.05, 0.099]}, {"t": 0.5, "translation": [-0.051, 0.05, 0.099]},
        {"t": 1, "translation": [-0.051, 0.05, 0.099]}]}}})");
  const SceneSummary summary = run_scene(data::load_scene(path), {}, out());
  EXPECT_EQ(summary.unconverged_steps, 0);
  const data::TriangleMesh last = data::load_triangle_mesh(out() + "/frames/000050.ply");
  EXPECT_NEAR(last.vertices.col(0).minCoeff(), 0.049, 1e-6);
}

}  // namespace
}  // namespace flash::sim
