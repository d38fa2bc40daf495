#include "sysid/report/summarize.h"

#include <gtest/gtest.h>

#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

// Without weight a sheet shows its bending by its inertia alone: most likely the file is wrong.
TEST(Summarize, ABendingFoundWithoutGravityIsDoubted) {
  const data::TemporaryFolder folder;
  std::vector<Replay> replays = {short_lift(folder)};
  GridSettings grid;
  grid.base.material = short_lift_material();
  grid.axes = {parse_axis("bending", "1e-4,2e-4,4e-4")};
  CandidateResult best;
  best.values = {2e-4};
  best.score = 0.001;
  best.recordings.resize(1);
  GridVerdict verdict;
  verdict.best = 0;
  verdict.parameters.resize(1);
  verdict.parameters[0].name = "bending";
  verdict.parameters[0].values = grid.axes[0].values;
  verdict.parameters[0].scores = {0.002, 0.001, 0.003};
  verdict.parameters[0].identifiable = Identifiable::upper_bound;
  const auto doubted = [&] {
    const GridResults results{grid.axes, {"lift"}, {best}};
    for (const std::string& warning : summarize(results, verdict, replays, grid).warnings)
      if (warning.find("lift: gravity is zero in recording.json") == 0) return true;
    return false;
  };
  EXPECT_FALSE(doubted());
  replays[0].recording.gravity.setZero();
  EXPECT_TRUE(doubted());
  verdict.parameters[0].identifiable = Identifiable::no;
  EXPECT_FALSE(doubted());
}

}  // namespace
}  // namespace flash::sysid
