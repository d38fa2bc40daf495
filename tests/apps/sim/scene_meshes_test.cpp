#include "apps/sim/scene_run.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "data/files/error.h"
#include "data/mesh/mesh_io.h"
#include "data/scene/scene.h"
#include "tests/apps/sim/scene_run_fixture.h"

namespace flash::sim {
namespace {

namespace fs = std::filesystem;

/// How often edges of the triangles of one mesh pass through triangles of the other.
int passing(const data::TriangleMesh& edges, const data::TriangleMesh& faces) {
  int count = 0;
  for (const auto& t : edges.triangles.rowwise())
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d p = edges.vertices.row(t[k]), q = edges.vertices.row(t[(k + 1) % 3]);
      for (const auto& f : faces.triangles.rowwise()) {
        const Eigen::Vector3d a = faces.vertices.row(f[0]);
        Eigen::Matrix3d m;  // p + s (q - p) = a + u (b - a) + v (c - a)
        m << p - q, faces.vertices.row(f[1]).transpose() - a, faces.vertices.row(f[2]).transpose() - a;
        if (std::abs(m.determinant()) < 1e-15) continue;
        const Eigen::Vector3d at = m.inverse() * (p - a);
        count += at.minCoeff() >= 0 && at[0] <= 1 && at[1] + at[2] <= 1;
      }
    }
  return count;
}

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
  write("chair.obj", read("assets/chair.obj"));
  write("blanket.json", replaced(read("assets/blanket.json"), "1.1x1.1:0.025", "1.1x1.1:0.055"));
  // 0.72 of a cell, as in the example.
  std::string scene = replaced(read("scenes/chair.json"), R"("margin": 0.018)", R"("margin": 0.0396)");
  for (const char* name : {"chair.obj", "blanket.json"})
    scene = replaced(scene, std::string("../assets/") + name, name);
  const std::string path = write("scene.json", scene);
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
  // Nothing comes through the cloth between its vertices, on its way and at rest.
  const data::TriangleMesh chair = data::load_triangle_mesh((folder_ / "chair.obj").string());
  for (const char* frame : {"000100", "000200", "000300", "000400", "000500"}) {
    const data::TriangleMesh cloth = data::load_triangle_mesh(out() + "/frames/" + frame + ".ply");
    EXPECT_EQ(passing(cloth, chair), 0) << frame;
    EXPECT_EQ(passing(chair, cloth), 0) << frame;
  }
  EXPECT_TRUE(summary.warnings.empty());
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
