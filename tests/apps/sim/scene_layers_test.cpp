#include "apps/sim/scene_run.h"

#include <gtest/gtest.h>

#include <filesystem>
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

namespace fs = std::filesystem;

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
    EXPECT_TRUE(text.starts_with(path + ": self_contact: start: ")) << text;
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

TEST_F(SceneRunTest, ASheetWithASeamThatIsNotJoinedIsWarnedOfOrRefused) {
  // Two halves of the cloth, each with the vertices between them.
  data::TriangleMesh mesh = data::parse_mesh_spec("sheet:0.1x0.1:0.02", "", "");
  const Eigen::Index vertices = mesh.vertices.rows();
  mesh.vertices.conservativeResize(vertices + 6, 3);
  for (int k = 0; k < 6; ++k) mesh.vertices.row(vertices + k) = mesh.vertices.row(18 + k);
  for (auto t : mesh.triangles.rowwise())
    if (t.minCoeff() >= 18)
      for (int& vertex : t)
        if (vertex < 24) vertex += static_cast<int>(vertices) - 18;
  data::save_triangle_mesh(mesh, (folder_ / "seam.obj").string());
  std::string asset = data::read_file((folder_ / "cloth.json").string());
  write("cloth.json", asset.replace(asset.find("sheet:0.1x0.1:0.02"), 18, "seam.obj"));
  const auto run = [&](const char* contact) {
    return run_scene(data::load_scene(write("scene.json", std::string(R"({"schema": "flash-scene/1",
      "timestep": 0.01, "steps": 1, "gravity": [0, 0, -9.81], "objects": {"cloth": "cloth.json"})") +
                                                              contact + "}")),
                     {}, out());
  };
  const std::vector<std::string> warnings = run("").warnings;
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0],
            "cloth: 12 of its 42 vertices share a place with another and are not joined: the mesh falls into "
            "2 parts; flash-sim mesh --weld joins them");
  try {
    run(R"(, "self_contact": {})");
    FAIL() << "it has to be refused";
  } catch (const data::InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("found the surface at vertex "), std::string::npos) << text;
    EXPECT_NE(text.find(" 0 m from that at "), std::string::npos) << text;
    EXPECT_NE(text.find("join the vertices there (flash-sim mesh)"), std::string::npos) << text;
  }
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

}  // namespace
}  // namespace flash::sim
