#include "apps/sim/scene_run.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "data/files/error.h"
#include "data/mesh/mesh_io.h"
#include "data/mesh/procedural_mesh.h"
#include "data/scene/scene.h"
#include "tests/apps/sim/scene_run_fixture.h"

namespace flash::sim {
namespace {

namespace fs = std::filesystem;

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
  EXPECT_NE(
      locking.warnings[0].find("box: bent, its linear tetrahedra are up to 87 % stiffer than their E says"),
      std::string::npos)
      << locking.warnings[0];
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
  EXPECT_EQ(message(box_scene("0.3", "projective", "")),
            (folder_ / "scene.json").string() +
                ": solver.type projective: box is a solid (element_type TETRAHEDRON), which type newton "
                "simulates alone");
  EXPECT_FALSE(fs::exists(fs::path(out()) / "log.csv"));
}

/// The example of the documents with cells of 55 mm in place of 25: it takes a tenth of the time.

}  // namespace
}  // namespace flash::sim
