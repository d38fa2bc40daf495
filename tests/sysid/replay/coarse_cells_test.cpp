#include "sysid/replay/coarse_cells.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace flash::sysid
