#include "sysid/replay/half_cell.h"

#include <gtest/gtest.h>

#include "data/mesh/procedural_mesh.h"
#include "data/meshing/remesh.h"
#include "sysid/observe/score.h"
#include "tests/sysid/short_lift.h"
#include "tests/sysid/tracked_beam.h"

namespace flash::sysid {
namespace {

std::string vtk_text(const data::TetMesh& mesh) {
  std::string text = "# vtk DataFile Version 3.0\nbeam\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS " +
                     std::to_string(mesh.vertices.rows()) + " double\n";
  for (const auto row : mesh.vertices.rowwise())
    text += std::to_string(row[0]) + " " + std::to_string(row[1]) + " " + std::to_string(row[2]) + "\n";
  const std::string count = std::to_string(mesh.tetrahedra.rows());
  text += "CELLS " + count + " " + std::to_string(5 * mesh.tetrahedra.rows()) + "\n";
  for (const auto row : mesh.tetrahedra.rowwise()) {
    text += "4";
    for (const int vertex : row) text += " " + std::to_string(vertex);
    text += "\n";
  }
  text += "CELL_TYPES " + count + "\n";
  for (Eigen::Index t = 0; t < mesh.tetrahedra.rows(); ++t) text += "10\n";
  return text;
}

TEST(HalfCell, SplitsTheTetrahedraOfAFile) {
  const data::TemporaryFolder folder;
  ReplaySettings settings;
  settings.solver.time_step = 1;
  settings.element_order = data::ElementOrder::quadratic;
  data::Recording recording = tracked_beam(folder, {0, 4, 4.5}, 0, 1, settings, beam_material());
  const data::TetMesh coarse = data::tet_box({0.1, 0.03, 0.03}, {4, 1, 1});
  settings.mesh = folder.write("beam.vtk", vtk_text(coarse));
  // By vertices, the wall of four becomes one of nine.
  data::Selection wall;
  wall.vertices = data::select_vertices(recording, recording.supports[0].select, "supports");
  recording.supports[0].select = wall;
  const Replay replay = make_replay(recording, settings);
  ASSERT_EQ(replay.recording.supports[0].select.vertices.size(), 4u);
  const Replay finer = on_half_the_cell(replay);
  EXPECT_EQ(finer.recording.tetrahedra.rows(), 8 * coarse.tetrahedra.rows());
  EXPECT_EQ(finer.recording.supports[0].select.vertices.size(), 9u);
  EXPECT_NEAR(finer.sheet().vertex_volume.sum(), replay.sheet().vertex_volume.sum(), 1e-15);

  // Its sag is nearer to that of the beam that was tracked, of cells of half the size.
  const auto miss = [&](const Replay& of) {
    Motion motion;
    run(of, {{{}, {}, beam_material()}}, scored_steps(of),
        [&](std::size_t, ReplayResult result) { motion = std::move(result.motion); });
    return keyframe_scores(of.surface.triangles, motion, of.observations, {}, {})[2];
  };
  EXPECT_LT(miss(finer), 0.4 * miss(replay));
  EXPECT_EQ(on_half_the_cell(finer).recording.tetrahedra.rows(), 64 * coarse.tetrahedra.rows());
}

TEST(HalfCell, TheSheetsCellsAreHalvedBesideTheSameCellsAtTheGrasp) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_corner_lift(folder, 0.1)};
  ASSERT_TRUE(are_graded(replays));
  const auto largest = [](const Replay& replay) { return data::edge_lengths(replay.recording.mesh).largest; };
  // Mean edge within half a millimetre of the corner of the patch.
  const auto near = [](const Replay& replay) {
    const data::TriangleMesh& sheet = replay.recording.mesh;
    double sum = 0;
    int count = 0;
    for (const auto triangle : sheet.triangles.rowwise())
      for (int k = 0; k < 3; ++k) {
        const Eigen::RowVector3d a = sheet.vertices.row(triangle[k]),
                                 b = sheet.vertices.row(triangle[(k + 1) % 3]);
        if ((0.5 * (a + b) - Eigen::RowVector3d(0.18, 0.18, 0)).norm() > 5e-4) continue;
        sum += (b - a).norm();
        ++count;
      }
    return sum / count;
  };
  const double widest = largest(replays[0]), narrowest = near(replays[0]);
  // Triangles are bisected towards the grasp: their edges fall by powers of 2^-1/2.
  constexpr double kBisected = 1.45;
  double part = 1;
  for (const HalvedSheet& pair : {halved_sheet(replays, 1), halved_sheet(replays, 2)}) {
    ASSERT_EQ(pair.before.size(), 1u);
    ASSERT_EQ(pair.after.size(), 1u);
    EXPECT_NEAR(largest(pair.before[0]), part * widest, 1e-12);
    part *= 0.5;
    EXPECT_NEAR(largest(pair.after[0]), part * widest, 1e-12);
    for (const Replay& replay : {pair.before[0], pair.after[0]}) {
      EXPECT_GT(near(replay), part * narrowest / kBisected);
      EXPECT_LT(near(replay), part * narrowest * kBisected);
    }
  }
  const double finest = near(on_half_the_cell(replays[0]));
  EXPECT_GT(finest, 0.25 * narrowest / kBisected);
  EXPECT_LT(finest, 0.25 * narrowest * kBisected);
}

}  // namespace
}  // namespace flash::sysid
