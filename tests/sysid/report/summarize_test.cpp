#include "sysid/report/summarize.h"

#include <gtest/gtest.h>

#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

/// A search for bending that came to 2e-4 N m.
struct BendingSearch {
  GridSettings grid;
  Answer answer;

  explicit BendingSearch(std::size_t recordings = 1) {
    grid.base.material = short_lift_material();
    grid.axes = {parse_axis("bending", "1e-4,2e-4,4e-4")};
    answer.best = 0;
    answer.values = {2e-4};
    answer.estimate.score = 0.005;
    answer.estimate.status = CandidateStatus::ok;
    answer.estimate.recordings.resize(recordings);
    answer.fit.score = answer.estimate;
  }
  Summary summary(const std::vector<Replay>& replays) const {
    const GridResults results{grid.axes, std::vector<std::string>(replays.size(), "lift"), {answer.estimate}};
    return summarize(results, answer, replays, grid);
  }
};

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
  Answer answer;
  answer.best = 0;
  answer.values = best.values;
  answer.estimate = answer.fit.score = best;
  ParameterFinding& bending = answer.parameters.emplace_back();
  bending.name = "bending";
  bending.values = grid.axes[0].values;
  bending.scores = {0.002, 0.001, 0.003};
  bending.identifiable = Identifiable::upper_bound;
  const auto doubted = [&] {
    const GridResults results{grid.axes, {"lift"}, {best}};
    for (const std::string& warning : summarize(results, answer, replays, grid).warnings)
      if (warning.find("lift: gravity is zero in recording.json") == 0) return true;
    return false;
  };
  EXPECT_FALSE(doubted());
  replays[0].recording.gravity.setZero();
  EXPECT_TRUE(doubted());
  bending.identifiable = Identifiable::no;
  EXPECT_FALSE(doubted());
}

TEST(Summarize, SaysThatAModelDoesNotFitAndWhatItsKeyframesAreWorth) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_lift(folder)};
  BendingSearch search;
  Answer& answer = search.answer;
  answer.misfits = {{0.001, 0.001, 0.0052, 0.0052, 0.3, 0.1, 90, true, 0.0028, 80, 9}};
  const auto first = [&] { return search.summary(replays).warnings; };
  ASSERT_FALSE(first().empty());
  EXPECT_EQ(
      first().front(),
      "lift: the model does not fit: apart from noise of 1 mm it misses the cloth by 5.2 mm where "
      "repeatability explains 2.8 mm; 80 keyframes are worth 9. The intervals allow for it, but are those of "
      "a model that does not fit");
  // A misfit that repeatability explains is none.
  answer.misfits[0].explained = answer.misfits[0].size - 1e-6;
  EXPECT_TRUE(first().empty());
  answer.misfits[0].explained = 0.0028;
  answer.misfits[0].found = false;
  EXPECT_TRUE(first().empty());
}

// Irregular cells of 33 mm: the edge of a patch of 51 mm goes through them.
TEST(Summarize, SaysThatCellsDoNotDivideTheGraspedPatch) {
  const auto warned = [](const std::string& mesh) {
    const data::TemporaryFolder folder;
    std::string all;
    for (const std::string& warning : BendingSearch().summary({short_lift(folder, mesh)}).warnings)
      all += warning + "\n";
    return all;
  };
  EXPECT_EQ(warned("sheet:0.2x0.05:0.025:alternating"), "");
  EXPECT_EQ(warned("sheet:0.2x0.05:0.03333333:alternating"), "");
  EXPECT_NE(warned("sheet:0.2x0.05:0.03333333:delaunay").find("lift: the cells hold "), std::string::npos);
}

TEST(Summarize, RecordingsThatContradictEachOtherCannotBeUsed) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays(2, short_lift(folder));
  BendingSearch search(2);
  search.answer.agreement = Agreement{30, 1e-5, {{1.5e-4}, {3e-4}}, {{0.1}, {0.1}}};
  const Summary summary = search.summary(replays);
  EXPECT_EQ(summary.exit_code, 3);
  ASSERT_FALSE(summary.warnings.empty());
  EXPECT_NE(summary.warnings.front().find("lift asks for bending 0.00015, lift asks for bending 0.0003"),
            std::string::npos)
      << summary.warnings.front();
  search.answer.agreement->chance = 0.02;
  EXPECT_EQ(search.summary(replays).exit_code, 0);
}

// Bending of cells of no size beside a score of coarse ones would say that a good fit is a bad one.
TEST(Summarize, TheScoreIsThatOfTheMeshThatTheAnswerIsOf) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_lift(folder)};
  GridSettings grid;
  grid.base.material = short_lift_material();
  grid.axes = {parse_axis("bending", "1e-4,2e-4,4e-4")};
  Answer answer;
  answer.best = 0;
  answer.values = {2e-4};
  answer.estimate.status = CandidateStatus::ok;
  answer.estimate.score = 0.005;
  answer.estimate.recordings.resize(1);
  answer.fit = {replays, {}, answer.estimate};
  const GridResults results{grid.axes, {"lift"}, {answer.estimate}};
  Summary summary = summarize(results, answer, replays, grid);
  EXPECT_EQ(summary.settings.at("score_of"), replays[0].recording.mesh_spec);
  EXPECT_EQ(summary.settings.at("observed"), "cloud");
  answer.fit.score.score = answer.fit.score.recordings[0].score = 0.001;
  summary = summarize(results, answer, replays, grid);
  EXPECT_EQ(summary.best_score, 0.001);
  EXPECT_EQ(summary.score_on_mesh, 0.005);
  EXPECT_EQ(summary.recordings[0].score, 0.001);
  EXPECT_EQ(summary.settings.at("score_of"), "cells of no size (extrapolated)");
}

}  // namespace
}  // namespace flash::sysid
