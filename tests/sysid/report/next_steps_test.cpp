#include "sysid/report/next_steps.h"

#include <gtest/gtest.h>

#include "tests/sysid/summary_fixture.h"

namespace flash::sysid {
namespace {

bool mentions(const std::vector<std::string>& lines, const std::string& words) {
  for (const std::string& line : lines)
    if (line.find(words) != std::string::npos) return true;
  return false;
}

TEST(NextSteps, NameTheExperimentThatWouldTell) {
  const std::vector<std::string> steps = next_steps(example_summary());
  EXPECT_TRUE(mentions(steps, "bias pull"));     // poisson is not known
  EXPECT_FALSE(mentions(steps, "corner lift"));  // bending is
  EXPECT_TRUE(mentions(steps, "export"));
}

TEST(NextSteps, WidenTheRangeBeforeTrustingItsEdge) {
  Summary summary = example_summary();
  summary.parameters[1].edge = RangeEdge::high;
  EXPECT_TRUE(mentions(next_steps(summary), "--bending"));
}

TEST(NextSteps, DoNotExportWhatCannotBeUsed) {
  Summary summary = example_summary();
  summary.exit_code = 3;
  EXPECT_FALSE(mentions(next_steps(summary), "export"));
}

TEST(NextSteps, AnAssumedWeightIsNotKnown) {
  Summary summary = example_summary();
  EXPECT_TRUE(mentions(standing_unknowns(summary), "Weigh the sheet"));
  summary.fixed["areal_density"].source = "measured";
  EXPECT_FALSE(mentions(standing_unknowns(summary), "Weigh the sheet"));
}

TEST(NextSteps, ChecksThatWereLeftOutAreNotKnown) {
  Summary summary = example_summary();
  summary.settings["solver_check"] = summary.settings["horizon"] = "yes";
  EXPECT_FALSE(mentions(standing_unknowns(summary), "asked for"));
  summary.settings["solver_check"] = "no";
  EXPECT_TRUE(mentions(standing_unknowns(summary), "finer solution"));
  summary.settings["horizon"] = "no";
  EXPECT_TRUE(mentions(standing_unknowns(summary), "predicted"));
}

}  // namespace
}  // namespace flash::sysid
