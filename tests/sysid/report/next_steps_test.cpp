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

NextExperiment experiment(const char* name, double bits, double poisson, double bending) {
  return {name, bits, {{"poisson", 0.1}, {"bending", 0.2}}, {{"poisson", poisson}, {"bending", bending}}};
}

TEST(NextSteps, NameTheExperimentThatIsExpectedToTellMost) {
  Summary summary = example_summary();
  summary.next_experiments = {experiment("bias_pull", 2, 0.02, 0.19),
                              experiment("lift again", 0.4, 0.1, 0.15)};
  const std::vector<std::string> steps = next_steps(summary);
  // 1.96 of 0.1 and of 0.02; bending is hardly narrowed.
  EXPECT_TRUE(mentions(
      steps, "Record a bias pull: it is expected to narrow Poisson's ratio from +- 0.196 to +- 0.0392"));
  EXPECT_FALSE(mentions(steps, "bending rigidity"));
  EXPECT_FALSE(mentions(steps, "once more"));
  EXPECT_TRUE(mentions(steps, "export"));
}

// The same search with another posterior proposes something else.
TEST(NextSteps, ChangeWithTheRanking) {
  Summary summary = example_summary();
  summary.next_experiments = {experiment("lift again", 1, 0.095, 0.1),
                              experiment("bias_pull", 0.5, 0.05, 0.2)};
  const std::vector<std::string> steps = next_steps(summary);
  // exp(1.96 0.2) and exp(1.96 0.1)
  EXPECT_TRUE(mentions(
      steps,
      "Record \"lift\" once more: it is expected to narrow bending rigidity from a factor of 1.48 to 1.2"));
  EXPECT_TRUE(
      mentions(steps, "Record a bias pull: it is expected to narrow Poisson's ratio"));  // which is not told
  for (NextExperiment& next : summary.next_experiments) next.spread = next.spread_before;
  EXPECT_FALSE(mentions(next_steps(summary), "Record"));
  EXPECT_TRUE(mentions(next_steps(summary), "No experiment that was tried would narrow Poisson's ratio"));
}

TEST(NextSteps, AreSilentOfExperimentsThatWereNotRanked) {
  EXPECT_FALSE(mentions(next_steps(example_summary()), "Record"));
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

TEST(NextSteps, AreNeverEmptyWhereTheAnswerCannotBeUsed) {
  Summary summary = example_summary();
  summary.exit_code = 3;
  summary.warnings = {"the estimate did not converge"};
  summary.unconverged = 0;
  for (ParameterFinding& finding : summary.parameters) {
    finding.identifiable = Identifiable::no;
    finding.edge = RangeEdge::none;
  }
  EXPECT_TRUE(mentions(next_steps(summary), "Look at the estimate"));
  EXPECT_TRUE(mentions(next_steps(summary), "The search says: the estimate did not converge."));
  summary.exit_code = 0;
  EXPECT_FALSE(next_steps(summary).empty());
  Summary nothing;  // of candidates that all diverged
  nothing.exit_code = 3;
  nothing.warnings = {"every candidate diverged: none has a score"};
  EXPECT_TRUE(mentions(next_steps(nothing), "--time-step"));
}

TEST(NextSteps, AnExportIsNeverProposedWithoutItsCaveats) {
  Summary summary = example_summary();
  summary.recordings[0].misfit.found = false;
  EXPECT_TRUE(caveats(summary).empty());
  EXPECT_EQ(next_steps(summary).back(),
            "Export the tuned asset with its intervals: flash-sysid export RUN -o tuned.json");
  EXPECT_FALSE(mentions(standing_unknowns(summary), "does not fit"));
  summary.recordings[0].misfit.found = true;
  EXPECT_TRUE(mentions(next_steps(summary),
                       "export RUN -o tuned.json (intervals are those of a model that does not fit lift)"));
  EXPECT_TRUE(mentions(standing_unknowns(summary), "the model does not fit lift"));
  EXPECT_TRUE(mentions(next_steps(summary), "Find what the model of lift misses"));
  summary.by_points = true;
  EXPECT_EQ(caveats(summary).size(), 2u);
  EXPECT_TRUE(mentions(next_steps(summary), "changes too abruptly between them; intervals are"));
  EXPECT_TRUE(
      mentions(next_steps(summary), "Search more values of bending rigidity: --bending 8e-05:0.00015:9:log"));
  EXPECT_TRUE(mentions(standing_unknowns(summary), "too abruptly"));
}

TEST(NextSteps, WhatWarningsNameStandsBeforeTheExport) {
  Summary summary = example_summary();
  summary.recordings[0].misfit.found = true;
  summary.warnings = {
      "lift: the model does not fit: apart from noise of 1.2 mm it misses the cloth by 1.64 mm",
      "young was not measured, and the recordings tell it: search it as well",
      "cells of 20.2 mm are coarse. Search on cells of 14 mm",
      "the answer is simulated on cells of 16 mm, not on those of 20 mm"};
  const std::vector<std::string> steps = next_steps(summary);
  EXPECT_TRUE(mentions(steps, "young was not measured, and the recordings tell it: search it as well."));
  EXPECT_TRUE(mentions(steps, "Search on cells of 14 mm."));
  EXPECT_FALSE(mentions(steps, "cells of 16 mm"));               // nothing is left to do about that
  EXPECT_FALSE(mentions(steps, "misses the cloth by 1.64 mm"));  // the step about the misfit says what to do
  EXPECT_TRUE(steps.back().starts_with("Export"));
  EXPECT_FALSE(steps.front().starts_with("Export"));
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
