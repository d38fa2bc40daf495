#include "sysid/emulate/search_warnings.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sysid/replay/coarse_cells.h"
#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

GridSettings search_of(const std::vector<double>& bending) {
  GridSettings grid;
  grid.base.material = short_lift_material();
  grid.axes = {{"bending", bending, true}};
  return grid;
}

TEST(SearchWarnings, CoarseCellsAreToldBeforeASearchOfWhereTheyAre) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_corner_lift(folder, 0.1)};
  const double weight = 9.81 * short_lift_material().areal_density,
               below = weight * std::pow(typical_cell(replays[0].recording.mesh) / most_of_fold_of_answer, 3);
  const auto known = [&](double low, double high) {
    return known_before(replays, search_of({low * below, high * below}), Coming::answer);
  };
  EXPECT_TRUE(known(1.01, 4).warnings.empty());
  EXPECT_TRUE(known(1.01, 4).notices.empty());
  // A part of the range: the answer may be elsewhere.
  EXPECT_TRUE(known(0.5, 4).warnings.empty());
  ASSERT_EQ(known(0.5, 4).notices.size(), 1u);
  EXPECT_NE(known(0.5, 4).notices[0].find("simulated on smaller cells, down to half of these"),
            std::string::npos)
      << known(0.5, 4).notices[0];
  EXPECT_EQ(known(0.5, 0.9).notices.size(), 1u);
  // Nothing is said of stiffnesses that are not searched.
  EXPECT_EQ(known(0.5, 4).notices[0].find("may be off"), std::string::npos) << known(0.5, 4).notices[0];
  // All of it is below what half of the cells take.
  const double halves = std::pow(most_of_fold_of_answer, 3);
  EXPECT_TRUE(known(0.5 * halves, 0.99 * halves).notices.empty());
  EXPECT_EQ(known(0.5 * halves, 0.99 * halves).warnings.size(), 1u);
  EXPECT_TRUE(known(0.5 * halves, 1.01 * halves).warnings.empty());
}

TEST(SearchWarnings, CoarseCellsOfWhatIsNotSolvedAgainStay) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_corner_lift(folder, 0.1)};
  const double weight = 9.81 * short_lift_material().areal_density,
               below = weight * std::pow(typical_cell(replays[0].recording.mesh) / most_of_fold, 3);
  const GridSettings search = search_of({0.5 * below, 4 * below});
  EXPECT_TRUE(known_before(replays, search_of({1.01 * below, 4 * below}), Coming::search).notices.empty());
  const std::vector<std::string> searched = known_before(replays, search, Coming::search).notices;
  ASSERT_EQ(searched.size(), 1u);
  EXPECT_EQ(searched[0].find("smaller cells"), std::string::npos) << searched[0];
  EXPECT_NE(searched[0].find("may be off"), std::string::npos) << searched[0];
  const std::vector<std::string> estimate =
      known_before(replays, held_at({0.5 * below}, search), Coming::estimate).warnings;
  ASSERT_EQ(estimate.size(), 1u);
  EXPECT_NE(estimate[0].find("is the estimate"), std::string::npos) << estimate[0];
}

// Layers keep the cells of the search.
TEST(SearchWarnings, CoarseCellsOfLayersAreSaidToStay) {
  const data::TemporaryFolder folder;
  std::vector<Replay> replays = {short_corner_lift(folder, 0.1)};
  replays[0].settings.self_contact = sim::SelfContact{.thickness = 1e-3};
  const double weight = 9.81 * short_lift_material().areal_density,
               below = weight * std::pow(typical_cell(replays[0].recording.mesh) / most_of_fold, 3);
  EXPECT_TRUE(known_before(replays, search_of({1.01 * below, 4 * below}), Coming::answer).notices.empty());
  const std::vector<std::string> notices =
      known_before(replays, search_of({0.5 * below, 4 * below}), Coming::answer).notices;
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_EQ(notices[0].find("smaller cells"), std::string::npos) << notices[0];
  EXPECT_NE(notices[0].find("may be off by a few percent"), std::string::npos) << notices[0];
  EXPECT_EQ(known_before(replays, search_of({0.5 * below, 0.9 * below}), Coming::answer).warnings.size(), 1u);
}

TEST(SearchWarnings, AnEstimateToGoOnFromIsTheWholeRange) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_corner_lift(folder, 0.1)};
  EXPECT_EQ(known_before(replays, held_at({1e-7}, search_of({1e-7, 1})), Coming::answer).warnings.size(), 1u);
  EXPECT_TRUE(known_before(replays, held_at({1}, search_of({1e-7, 1})), Coming::answer).warnings.empty());
}

// Cells that shrink towards the grasp hold the patch that was stated; too large ones there do not.
TEST(SearchWarnings, APatchThatCellsDoNotHoldIsTold) {
  const data::TemporaryFolder folder;
  Replay replay = short_corner_lift(folder, 0.1);
  EXPECT_TRUE(warnings_of_grasps({replay}).empty());
  ReplaySettings settings;
  settings.grasp_cell = 0;  // the mesh as it is: cells of 40 mm
  replay = make_replay(data::load_recording(folder / "towel"), settings);
  const std::vector<std::string> warnings = warnings_of_grasps({replay});
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("the cells hold 0 mm of the sheet"), std::string::npos) << warnings[0];
  EXPECT_NE(warnings[0].find("where 28.28 mm are stated"), std::string::npos) << warnings[0];
}

}  // namespace
}  // namespace flash::sysid
