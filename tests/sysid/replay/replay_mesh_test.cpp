#include "sysid/replay/replay_mesh.h"

#include <gtest/gtest.h>

#include "data/mesh/mesh_io.h"
#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

TEST(ReplayMesh, OfASpecificationTheCellTakesTheFactor) {
  EXPECT_EQ(scaled_cell("sheet:0.4x0.4:0.02", 0.5), "sheet:0.4x0.4:0.01");
  EXPECT_EQ(scaled_cell("sheet:0.4x0.3:0.02:alternating", 2), "sheet:0.4x0.3:0.04:alternating");
  EXPECT_EQ(scaled_cell("box:0.1x0.03x0.03:0.01", 0.5), "box:0.1x0.03x0.03:0.005");
  EXPECT_EQ(scaled_cell("towel.obj", 0.5), "");
}

// Whether it is read from its files or taken over from another replay.
TEST(ReplayMesh, IsOneWhereverItComesFrom) {
  const data::TemporaryFolder folder;
  const Replay recorded = short_corner_lift(folder, 0.1);
  const data::Recording recording = data::load_recording(folder / "towel");
  data::save_triangle_mesh(data::parse_mesh_spec("sheet:0.2x0.2:0.04:alternating"), folder / "towel.obj");
  for (const std::string& mesh : {std::string(), std::string("sheet:0.2x0.2:0.03"), folder / "towel.obj"}) {
    ReplaySettings settings = recorded.settings;
    settings.mesh = mesh;
    const Replay whole = make_replay(recording, settings);
    for (const double scale : {0.8, 0.45}) {
      settings.cell_scale = scale;
      const Replay from_file = make_replay(recording, settings), from_replay = make_replay(whole, settings);
      EXPECT_EQ(from_file.recording.mesh.vertices, from_replay.recording.mesh.vertices) << mesh;
      EXPECT_EQ(from_file.recording.mesh.triangles, from_replay.recording.mesh.triangles) << mesh;
      const Eigen::Index triangles = from_file.recording.mesh.triangles.rows();
      if (mesh == folder / "towel.obj")
        EXPECT_EQ(triangles, 4 * whole.recording.mesh.triangles.rows());  // halves alone
      else
        EXPECT_GT(triangles, whole.recording.mesh.triangles.rows());
    }
  }
}

// Cells at the grasp follow, those that were asked for too.
TEST(ReplayMesh, CellsAtTheGraspTakeTheFactor) {
  const data::TemporaryFolder folder;
  const Replay recorded = short_corner_lift(folder, 0.1);
  ReplaySettings settings = recorded.settings;
  settings.grasp_cell = 0.004;
  EXPECT_EQ(make_replay(recorded, settings).recording.grasps[0].cell,
            recorded.recording.grasps[0].cell);  // the same mesh
  settings.cell_scale = 0.5;
  EXPECT_NEAR(make_replay(recorded, settings).recording.grasps[0].cell, 0.002, 1e-12);
}

TEST(ReplayMesh, OfASheetThatStartsInItsOwnShapeIsHalved) {
  const data::TemporaryFolder folder;
  Replay recorded = short_corner_lift(folder, 0.1);
  recorded.recording.start_mesh = "start.obj";
  ReplaySettings settings = recorded.settings;
  settings.cell_scale = 0.6;
  const Replay halved = make_replay(recorded, settings);
  EXPECT_EQ(halved.recording.mesh.triangles.rows(), 4 * recorded.recording.mesh.triangles.rows());
  EXPECT_EQ(halved.recording.start.rows(), halved.recording.mesh.vertices.rows());
}

}  // namespace
}  // namespace flash::sysid
