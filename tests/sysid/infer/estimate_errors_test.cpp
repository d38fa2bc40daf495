#include "sysid/infer/estimate_errors.h"

#include <gtest/gtest.h>

#include <cmath>

#include "data/files/atomic_file.h"
#include "data/files/sha256.h"
#include "sysid/infer/held.h"
#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

/// What a search of bending at 2e-4 N m says of E t, held at 30 N/m give or take 10.
struct HeldMembrane {
  std::vector<KnownError> errors;
  std::vector<std::string> warnings;
};

/// Keeps the motion of a candidate as one that diverged.
void let_diverge(const MotionStore& store, const std::string& folder, const Replay& replay,
                 const ReplayCandidate& candidate) {
  store.run(replay, candidate);
  const std::string file = folder + "/" + motion_key(replay, candidate) + ".rollout";
  const std::string whole = data::read_file(file);
  const std::size_t numbers_at = whole.find('\n') + 1 + 2 * 64, finite_at = 5 * sizeof(double) + 1;
  std::string numbers = whole.substr(numbers_at);
  ASSERT_EQ(numbers.at(finite_at), 1);
  numbers[finite_at] = 0;
  data::write_atomically(file, whole.substr(0, numbers_at - 64) + data::sha256(numbers) + numbers);
}

/// `diverging`: values of E t at which the motion diverges.
HeldMembrane held_membrane(const std::vector<double>& diverging) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_lift(folder)}, none;
  GridSettings grid;
  grid.base.material = short_lift_material();
  grid.axes = {parse_axis("bending", "1e-4:4e-4:3:log")};
  grid.fixed = {parse_hold("areal_density=0.2:measured").axis, parse_hold("friction=0.3:measured").axis,
                parse_hold("young=30").axis};
  grid.deviations = {{"young", 10}};
  const AnswerSettings settings;
  const MotionStore store(folder / "motions");
  const TellWork untold;
  const Task task{replays, none, grid, grid.axes, settings, store, untold};
  const std::vector<double> values = {2e-4};
  for (const double value : diverging)
    let_diverge(store, folder / "motions", replays[0], candidate_with(values, grid, "young", value));
  const std::vector<ReplayResult> here = {store.run(replays[0], candidate_at(values, grid))};
  HeldMembrane held{errors_of_held(task, values, here), {}};
  const MotionLikelihood likelihood(replays, here, grid.score, {}, held.errors, {});
  warn_of_held(task, values, likelihood, held.errors, held.warnings);
  return held;
}

/// A part of the way from 30 to 20 or 40 N/m, by a factor.
double nearer(double end, double share) { return 30 * std::pow(end / 30, share); }

bool names_what_is_left_out(const HeldMembrane& held) {
  for (const std::string& warning : held.warnings)
    if (warning.find("young was not measured, and motions at other values of it diverge") == 0) return true;
  return false;
}

TEST(EstimateErrors, OfWhatIsHeldBend) {
  const HeldMembrane held = held_membrane({});
  ASSERT_EQ(held.errors.size(), 1u);
  EXPECT_EQ(held.errors[0].terms[0].factor, -0.5);
  EXPECT_EQ(held.errors[0].terms[1].factor, 0.5);
  EXPECT_EQ(held.errors[0].bend.size(), 3u);
  EXPECT_FALSE(names_what_is_left_out(held));
}

// One deviation moves by the difference over the deviations between both ends: 1 + 1/4.
TEST(EstimateErrors, WhatDivergesIsAskedNearer) {
  const HeldMembrane held = held_membrane({40, nearer(40, 0.5)});
  ASSERT_EQ(held.errors.size(), 1u);
  EXPECT_DOUBLE_EQ(held.errors[0].terms[0].factor, -0.8);
  EXPECT_DOUBLE_EQ(held.errors[0].terms[1].factor, 0.8);
  for (const MotionTerm& term : held.errors[0].terms) EXPECT_TRUE(term.motions->results[0].finite);
  EXPECT_TRUE(held.errors[0].bend.empty());
  EXPECT_FALSE(names_what_is_left_out(held));
}

TEST(EstimateErrors, WhereOneSideDivergesTheOtherStandsForBoth) {
  const HeldMembrane held = held_membrane({20, nearer(20, 0.5), nearer(20, 0.25), nearer(20, 0.125)});
  ASSERT_EQ(held.errors.size(), 1u);
  EXPECT_EQ(held.errors[0].terms[0].factor, -1);
  EXPECT_EQ(held.errors[0].terms[1].factor, 1);
  for (const MotionTerm& term : held.errors[0].terms) EXPECT_TRUE(term.motions->results[0].finite);
  EXPECT_TRUE(held.errors[0].bend.empty());
  EXPECT_FALSE(names_what_is_left_out(held));
}

TEST(EstimateErrors, WhatDivergesOnBothSidesIsNamed) {
  std::vector<double> all;
  for (const double end : {20, 40})
    for (const double share : {1.0, 0.5, 0.25, 0.125}) all.push_back(share == 1 ? end : nearer(end, share));
  const HeldMembrane held = held_membrane(all);
  EXPECT_TRUE(held.errors.empty());
  EXPECT_TRUE(names_what_is_left_out(held));
}

}  // namespace
}  // namespace flash::sysid
