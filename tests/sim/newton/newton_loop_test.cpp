#include "sim/newton/newton_loop.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace flash::sim {
namespace {

/// A step that goes as it is told, and counts.
struct Told {
  int most = 60;        ///< iterations
  double residual = 1;  ///< over the tolerance
  bool falls = true;    ///< what a trial's potential does
  double shrinks = 1;   ///< the residual at a trial, as a share
  double potential = 0;
  bool coupled_once = false;  ///< whether a failed iteration is repeated without coupling

  int iterations = 0, directions = 0, stuck = 0, coupled = 0, renewed = 0, moved = 0, accepted = 0;

  int most_iterations() const { return most; }
  bool rests() const { return residual <= start_tolerance_share; }
  bool balanced() const { return residual <= 1; }
  bool begin_iteration() {
    ++iterations;
    return true;
  }
  bool couples(int, bool) const { return coupled_once && coupled == 0; }
  void find_direction(bool is_stuck, bool is_coupled) {
    ++directions;
    stuck += is_stuck;
    coupled += is_coupled;
  }
  double slope() const { return -1; }
  bool repeats(bool is_coupled) const { return is_coupled; }
  void renew() { ++renewed; }
  void go_to_trial(double) {
    ++accepted;
    residual *= shrinks;
  }

  double start_potential() const { return 0; }
  double start_residual() const { return 1; }
  double trial_potential() const { return falls ? -1 : potential; }
  double trial_residual() const { return shrinks; }
  bool trial_is_finite() const { return std::isfinite(trial_potential()); }
  double second_potential() const { return trial_potential(); }
  double second_residual() const { return shrinks; }
  double end_slope() const { return 0; }
  double move(double length) {
    ++moved;
    return length;
  }
  double move_second(double length) { return move(length); }
  void take_second() {}
};

// Forces of a tolerance move something: only those below a thousandth of it leave a step where it starts.
TEST(NewtonLoop, AStepThatStartsInBalanceToAThousandthOfTheToleranceStaysThere) {
  Told step{.residual = 0.99e-3};
  iterate(step);
  EXPECT_EQ(step.iterations, 0);
  Told little{.residual = 1.01e-3};
  iterate(little);
  EXPECT_EQ(little.iterations, 1);
}

TEST(NewtonLoop, ItEndsInBalanceOrAfterTheMostIterations) {
  Told step{.residual = 100, .shrinks = 0.1};
  iterate(step);
  EXPECT_EQ(step.iterations, 2);
  Told slow{.most = 7, .residual = 100, .shrinks = 1};
  iterate(slow);
  EXPECT_EQ(slow.iterations, 7);
  EXPECT_EQ(slow.accepted, 7);
}

// Each second iteration is one with a fresh factor; six moves that nothing speaks for, and the end.
TEST(NewtonLoop, WhereNothingIsAcceptableItForcesSixMoves) {
  Told step{.residual = 100, .falls = false, .shrinks = 1};
  iterate(step);
  EXPECT_EQ(step.accepted, 6);
  EXPECT_EQ(step.iterations, 14);
  EXPECT_EQ(step.renewed, 7);
  EXPECT_EQ(step.stuck, 7);
  Told infinite{
      .residual = 100, .falls = false, .shrinks = 1, .potential = std::numeric_limits<double>::infinity()};
  iterate(infinite);
  EXPECT_EQ(infinite.accepted, 0);
  EXPECT_EQ(infinite.iterations, 2);
}

TEST(NewtonLoop, AnIterationThatCouplingSpoiltIsRepeatedWithout) {
  Told step{.most = 3, .residual = 100, .falls = true, .shrinks = 1, .coupled_once = true};
  iterate(step);
  EXPECT_EQ(step.coupled, 1);
  EXPECT_EQ(step.renewed, 0);
  EXPECT_EQ(step.accepted, 2);
}

TEST(NewtonLoop, ContactsAreExchangedInSixLinearProblemsAtMost) {
  int solved = 0, exchanged = 0;
  solve_and_exchange([&](int k) { EXPECT_EQ(k, solved++); }, [&] { return ++exchanged > 0; });
  EXPECT_EQ(solved, 6);
  EXPECT_EQ(exchanged, 5);
  solved = exchanged = 0;
  solve_and_exchange([&](int) { ++solved; }, [&] { return ++exchanged < 3; });
  EXPECT_EQ(solved, 3);
}

TEST(NewtonLoop, FrictionFollowsNormalForcesInPartsOfAStepAfterTwentyIterations) {
  EXPECT_FALSE(couples_friction(0.01, 0.01, 60));
  EXPECT_FALSE(couples_friction(0.005, 0.01, 20));
  EXPECT_TRUE(couples_friction(0.005, 0.01, 21));
}

}  // namespace
}  // namespace flash::sim
