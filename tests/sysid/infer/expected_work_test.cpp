#include "sysid/infer/expected_work.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sysid/replay/coarse_cells.h"
#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

TEST(ExpectedWork, TheMiddleIsThatOfTheLogarithmsWhereTheseAreSearched) {
  EXPECT_EQ(middle_of({{"bending", {1e-3, 1e-5, 1e-4}, true}, {"friction", {0.5, 0.2}, false}}),
            (std::vector<double>{1e-4, 0.35}));
}

// An answer on smaller cells has its own motions, each of which is dearer by what its vertices cost, after a
// look at those of the search.
TEST(ExpectedWork, OfAnAnswerOnSmallerCellsIsThatOfItsMotions) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_corner_lift(folder, 0.2)};
  GridSettings grid;
  grid.base.material = short_lift_material();
  const double weight = 9.81 * short_lift_material().areal_density,
               radius = typical_cell(replays[0].recording.mesh) / 0.5, limp = weight * std::pow(radius, 3);
  grid.axes = {{"bending", {limp, 20 * limp}, true}, {"friction", {0.2, 0.4}, false}};
  grid.threads = 1;
  const ExpectedWork own = expected_work(replays, grid, true, {20 * limp, 0.3}),
                     smaller = expected_work(replays, grid, true, {limp, 0.3}),
                     unchecked = expected_work(replays, grid, false, {limp, 0.3});
  const std::vector<Replay> on = on_cells_for_fold(replays, candidate_at({limp, 0.3}, grid));
  ASSERT_EQ(on.size(), 1u);
  const auto vertices = [](const Replay& replay) {
    return static_cast<double>(replay.recording.mesh.vertices.rows());
  };
  const double each = motion_cost(vertices(on[0]) / vertices(replays[0]), 1);
  EXPECT_GT(each, 1);
  const ExpectedWork there = expected_work(on, grid, true, {20 * limp, 0.3});
  EXPECT_DOUBLE_EQ(smaller.lattices, there.lattices + 1);
  EXPECT_DOUBLE_EQ(smaller.lattices * smaller.lattice,
                   each * (smaller.lattices * there.lattice + there.first_look));
  EXPECT_DOUBLE_EQ(smaller.end, each * there.end);
  EXPECT_DOUBLE_EQ(smaller.first_look, unchecked.first_look);
  EXPECT_LT(smaller.first_look, own.first_look);
  EXPECT_DOUBLE_EQ(unchecked.lattice, expected_work(replays, grid, false, {20 * limp, 0.3}).lattice);
}

}  // namespace
}  // namespace flash::sysid
