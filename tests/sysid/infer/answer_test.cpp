#include "sysid/infer/answer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>

#include "sysid/replay/coarse_cells.h"
#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

GridSettings bending_grid() {
  GridSettings grid;
  grid.base.material = short_lift_material();
  grid.axes = {parse_axis("bending", "5e-5:1e-3:5:log")};
  return grid;
}

AnswerSettings without_horizon() {
  AnswerSettings settings;
  settings.horizon = false;
  return settings;
}

void expect_the_same_on_any_threads(PosteriorMethod method) {
  const data::TemporaryFolder folder;
  GridSettings grid = bending_grid();
  grid.axes.push_back(parse_axis("friction", "0.1:0.6:4"));
  grid.rollouts = folder / "rollouts";
  std::vector<Replay> replays = {short_lift(folder, "sheet:0.2x0.05:0.0125:alternating")};
  ResultsStore store(folder / "run", grid.axes, {"lift"}, {}, Existing::refuse);
  ASSERT_TRUE(grid_search(replays, grid, store));
  AnswerSettings asked = without_horizon();
  asked.solver_check = false;
  asked.posterior = method;
  const auto answer = [&](int threads) {
    GridResults results = store.results();
    grid.threads = replays[0].settings.threads = threads;
    AnswerMeter meter(most_work(grid, 1, false));
    std::mutex counting;
    bool kept = true;
    Answer found =
        find_answer(results, replays, grid, asked, [&](const AnswerWork& done, const AnswerWork& spared) {
          const std::scoped_lock lock(counting);
          meter.take(done, spared);
          kept = kept && meter.done().scores <= meter.most().scores &&
                 meter.done().motions <= meter.most().motions;
        });
    EXPECT_TRUE(kept);  // what there is at most, at any time
    EXPECT_GT(meter.done().scores, 0);
    return found;
  };
  const Answer one = answer(1), four = answer(4);
  EXPECT_EQ(one.values, four.values);
  EXPECT_EQ(one.samples, four.samples);
  EXPECT_EQ(one.estimate.score, four.estimate.score);
  EXPECT_EQ(one.open_information, four.open_information);
}

TEST(Answer, IsTheSameOnAnyThreads) { expect_the_same_on_any_threads(PosteriorMethod::grids); }

TEST(Answer, IsTheSameOnAnyThreadsWhereItIsSampled) {
  expect_the_same_on_any_threads(PosteriorMethod::sampling);
}

TEST(Answer, KeptMotionsGiveTheTruthBackBetweenTheValuesOfTheGrid) {
  const data::TemporaryFolder folder;
  std::vector<Replay> replays = {short_lift(folder, "sheet:0.2x0.05:0.0041666667:alternating_by_row")};
  ReplaySettings settings = replays[0].settings;
  settings.mesh = "sheet:0.2x0.05:0.0125:alternating";
  replays[0] = make_replay(replays[0].recording, settings);
  GridSettings grid = bending_grid();
  grid.rollouts = folder / "rollouts";
  ResultsStore store(folder / "run", grid.axes, {"lift"}, {}, Existing::refuse);
  ASSERT_TRUE(grid_search(replays, grid, store));
  GridResults results = store.results();
  AnswerWork all, unused;
  const AnswerWork most = most_work(grid, 1, true);
  const Answer answer = find_answer(results, replays, grid, without_horizon(),
                                    [&](const AnswerWork& done, const AnswerWork& spared) {
                                      all.motions += done.motions, all.scores += done.scores;
                                      unused.scores += spared.scores;
                                    });
  // Three values of five on the finer mesh, and the estimate; 17 points a grid.
  EXPECT_GE(all.motions, 3 + 1);
  EXPECT_LE(all.motions, most.motions);
  EXPECT_GT(all.scores, 0);
  EXPECT_EQ(all.scores % 17, 0);
  EXPECT_LE(all.scores + unused.scores, most.scores);
  const ParameterFinding& bending = answer.parameters.front();
  EXPECT_EQ(bending.identifiable, Identifiable::yes);
  EXPECT_LT((*bending.interval95)[0], 2e-4);
  EXPECT_GT((*bending.interval95)[1], 2e-4);
  // Cells of 12.5 mm alone are off by more; the finer mesh and the limit take that away.
  EXPECT_NEAR(*bending.estimate, 2e-4, 0.1 * 2e-4);
  // What is shown is the estimate itself: its score is what its motion has.
  EXPECT_EQ(answer.estimate.score, score_motions(replays, answer.motions, grid.score).score);
  EXPECT_EQ(answer.values.front(), *bending.estimate);
  EXPECT_EQ(bending.values.front(), grid.axes[0].values.front());
  EXPECT_EQ(bending.values.back(), grid.axes[0].values.back());
}

// A strip that bends over its own length of 34 mm, searched on cells of 25 mm.
TEST(Answer, IsOfCellsForTheFoldUnlessTheRecordingIsOfCoarseOnes) {
  const data::TemporaryFolder folder;
  data::SheetMaterial limp = short_lift_material();
  limp.bending_rigidity = 8e-5;
  const std::string coarse = "sheet:0.2x0.05:0.025:alternating";
  const auto answered_on = [&](const std::string& made_on) {  // cells over those of the search
    std::vector<Replay> replays = {short_lift(folder, made_on, limp)};
    ReplaySettings settings = replays[0].settings;
    settings.mesh = coarse;
    replays[0] = make_replay(replays[0].recording, settings);
    const double cell = typical_cell(replays[0].recording.mesh);
    GridSettings grid = bending_grid();
    grid.rollouts = folder / "rollouts";
    const data::TemporaryFolder run;
    ResultsStore store(run / "run", grid.axes, {"lift"}, {}, Existing::refuse);
    EXPECT_TRUE(grid_search(replays, grid, store));
    GridResults results = store.results();
    const Answer answer = find_answer(results, replays, grid, without_horizon());
    const double share = typical_cell(replays[0].recording.mesh) / cell;
    const bool told = std::any_of(answer.warnings.begin(), answer.warnings.end(), [](const auto& warning) {
      return warning.find("the answer is simulated on cells of") != std::string::npos;
    });
    EXPECT_EQ(told, share < 1);
    EXPECT_NEAR(answer.values.front(), 8e-5, 0.25 * 8e-5) << made_on;
    return share;
  };
  EXPECT_LT(answered_on("sheet:0.2x0.05:0.0041666667:alternating"), 0.8);
  EXPECT_EQ(answered_on(coarse), 1);
}

// Thickness is a power of two, so that not even rounding tells E and E t apart.
TEST(Answer, IsThatOfTheSameMembraneAsModulusAndAsStiffness) {
  const data::TemporaryFolder folder;
  const auto answer = [&](std::optional<double> thickness) {
    std::vector<Replay> replays = {short_lift(folder)};
    GridSettings grid = bending_grid();
    grid.base.thickness = thickness;
    grid.rollouts = folder / "rollouts";
    ResultsStore store(folder / (thickness ? "modulus" : "stiffness"), grid.axes, {"lift"}, {},
                       Existing::refuse);
    EXPECT_TRUE(grid_search(replays, grid, store));
    GridResults results = store.results();
    AnswerSettings asked = without_horizon();
    asked.solver_check = false;
    return find_answer(results, replays, grid, asked);
  };
  const Answer stiffness = answer({}), modulus = answer(1.0 / 2048);
  EXPECT_EQ(stiffness.values, modulus.values);
  EXPECT_EQ(stiffness.samples, modulus.samples);
  EXPECT_EQ(stiffness.parameters[0].bits, modulus.parameters[0].bits);
  EXPECT_EQ(stiffness.warnings, modulus.warnings);
}

/// A search of the first so many of these, two values each, with the truth between them, by one of `every`
/// keyframes.
Answer answer_of_searched(std::size_t count, std::size_t every, int& motions) {
  const data::TemporaryFolder folder;
  std::vector<Replay> replays = {short_lift(folder)};
  for (std::size_t i = 0; i < replays[0].observations.size(); ++i)
    if (i % every != every - 1) replays[0].observations[i].weight = 0;
  GridSettings grid;
  grid.base.material = short_lift_material();
  grid.axes = {parse_axis("bending", "1e-4:4e-4:2:log"), parse_axis("friction", "0.2:0.5:2"),
               parse_axis("young", "15:60:2:log"), parse_axis("table_height", "-0.002:0.003:2"),
               parse_axis("poisson", "0.2:0.4:2")};
  grid.axes.resize(count);
  grid.rollouts = folder / "rollouts";
  ResultsStore store(folder / "run", grid.axes, {"lift"}, {}, Existing::refuse);
  EXPECT_TRUE(grid_search(replays, grid, store));
  GridResults results = store.results();
  AnswerSettings asked = without_horizon();
  asked.solver_check = false;
  return find_answer(results, replays, grid, asked,
                     [&](const AnswerWork& done, const AnswerWork&) { motions += done.motions; });
}

bool says_it_is_not_refined(const Answer& answer) {
  return std::any_of(answer.warnings.begin(), answer.warnings.end(), [](const std::string& warning) {
    return warning.find("parameters are searched together") != std::string::npos;
  });
}

TEST(Answer, FourParametersAreSimulatedAboutIt) {
  int motions = 0;
  const Answer answer = answer_of_searched(4, 1, motions);
  EXPECT_GE(motions, 81);  // three values of each
  EXPECT_FALSE(says_it_is_not_refined(answer));
  EXPECT_NEAR(answer.values[0], 2e-4, 0.1 * 2e-4);
}

TEST(Answer, FiveParametersAreSaidNotToBeSimulatedAboutIt) {
  int motions = 0;
  EXPECT_TRUE(says_it_is_not_refined(answer_of_searched(5, 5, motions)));
  EXPECT_LT(motions, 81);
}

/// What two recordings of strips of these bending rigidities say together.
Answer answer_of_two(double first, double second) {
  const std::array<data::TemporaryFolder, 3> folders;
  std::vector<Replay> replays;
  for (const double bending : {first, second}) {
    data::SheetMaterial material = short_lift_material();
    material.bending_rigidity = bending;
    const auto r = static_cast<unsigned>(replays.size());
    replays.push_back(short_lift(folders[r], "sheet:0.2x0.05:0.0125:alternating", material, r + 1));
  }
  GridSettings grid = bending_grid();
  grid.rollouts = folders[2] / "rollouts";
  ResultsStore store(folders[2] / "run", grid.axes, {"first", "second"}, {}, Existing::refuse);
  EXPECT_TRUE(grid_search(replays, grid, store));
  GridResults results = store.results();
  AnswerSettings settings = without_horizon();
  settings.solver_check = false;
  return find_answer(results, replays, grid, settings);
}

TEST(Answer, SaysThatTwoClothsAreNotOne) {
  const Answer one = answer_of_two(2e-4, 2e-4), two = answer_of_two(1.5e-4, 3e-4);
  ASSERT_TRUE(one.agreement && two.agreement);
  EXPECT_GT(one.agreement->chance, 0.01);
  EXPECT_LT(two.agreement->chance, 0.01);
  EXPECT_NEAR(two.agreement->alone[0][0], 1.5e-4, 0.2 * 1.5e-4);
  EXPECT_NEAR(two.agreement->alone[1][0], 3e-4, 0.2 * 3e-4);
}

}  // namespace
}  // namespace flash::sysid
