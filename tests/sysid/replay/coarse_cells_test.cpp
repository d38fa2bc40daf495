#include "sysid/replay/coarse_cells.h"

#include <gtest/gtest.h>

#include "data/mesh/mesh_io.h"
#include "data/mesh/procedural_mesh.h"
#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

TEST(CoarseCells, ATypicalCellIsAnEquilateralTriangleOfTheSameArea) {
  // Right triangles of h^2 / 2 are as large as equilateral ones of the side h (4 / 3)^(1/4).
  EXPECT_NEAR(typical_cell(data::parse_mesh_spec("sheet:0.2x0.2:0.02:alternating")),
              0.02 * std::pow(4.0 / 3, 0.25), 1e-12);
}

TEST(CoarseCells, AreToldWhereTheFoldIsNotFarLarger) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_lift(folder)};  // cells of 27 mm
  ReplayCandidate candidate;
  candidate.material.areal_density = 0.2;
  const double cell = typical_cell(replays[0].recording.mesh);
  const auto with_radius = [&](double radius) -> std::string {
    candidate.material.bending_rigidity = 0.2 * 9.81 * radius * radius * radius;
    const std::optional<CoarseCells> coarse = coarse_cells(replays, candidate);
    return coarse ? coarse_cells_text(*coarse) : "";
  };
  EXPECT_EQ(with_radius(1.01 * cell / 0.5), "");
  EXPECT_NE(with_radius(0.99 * cell / 0.5).find("cells of 26.9 mm are coarse"), std::string::npos)
      << with_radius(0.99 * cell / 0.5);
  EXPECT_EQ(with_radius(0), "");
}

TEST(CoarseCells, OfAnAnswerTakeThreeEighthsOfTheFold) {
  const data::TemporaryFolder folder;
  const Replay recorded = short_corner_lift(folder, 0.2);
  ReplaySettings of_file = recorded.settings, as_made = recorded.settings;
  as_made.mesh = "sheet:0.2x0.2:0.015";
  const Replay made = make_replay(recorded, as_made);  // graded
  data::save_triangle_mesh(made.recording.mesh, folder / "towel.obj");
  of_file.mesh = folder / "towel.obj";
  ReplayCandidate candidate;
  candidate.material.areal_density = 0.2;
  for (const Replay& replay : {made, make_replay(recorded, of_file)}) {
    const double cell = typical_cell(replay.recording.mesh);
    // Cells of the answer over those of the search; 0: they are the same.
    const auto smaller = [&](double radius) {
      candidate.material.bending_rigidity = 0.2 * 9.81 * radius * radius * radius;
      const std::vector<Replay> on = on_cells_for_fold({replay}, candidate);
      return on.empty() ? 0 : typical_cell(on.front().recording.mesh) / cell;
    };
    EXPECT_EQ(smaller(cell / 0.37), 0);
    const bool is_file = replay.settings.mesh == of_file.mesh;
    EXPECT_NEAR(smaller(cell / 0.5), is_file ? 0.5 : 0.75, 0.08);
    EXPECT_NEAR(smaller(cell / 2), 0.5, 0.05);  // no smaller than that
    if (is_file) continue;
    for (const double share : {0.41, 0.45, 0.5, 0.6})  // on a small sheet too, of which the grasp is much
      EXPECT_LE(share * smaller(cell / share), most_of_fold_of_answer) << share;
  }
}

TEST(CoarseCells, OfAnAnswerKeepTheLayersOfASheetThatMeetsItself) {
  const data::TemporaryFolder folder;
  Replay replay = short_corner_lift(folder, 0.2);
  replay.settings.self_contact = sim::SelfContact{.thickness = 1e-3};
  ReplayCandidate candidate;
  candidate.material.areal_density = 0.2;
  candidate.material.bending_rigidity = 1e-6;
  EXPECT_TRUE(on_cells_for_fold({replay}, candidate).empty());
}

}  // namespace
}  // namespace flash::sysid
