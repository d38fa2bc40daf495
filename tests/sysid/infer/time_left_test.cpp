#include "sysid/infer/time_left.h"

#include <gtest/gtest.h>

#include <vector>

namespace flash::sysid {
namespace {

constexpr ExpectedWork kExpected = {.first_look = 20, .lattice = 10, .lattices = 3, .end = 2};

TEST(TimeLeft, IsNotKnownBeforeAnythingWasMeasured) {
  TimeLeft time(kExpected);
  EXPECT_FALSE(time.seconds(0));
  time.begin(SearchStage::lattice, 100);  // as a search that goes on from another begins
  EXPECT_FALSE(time.seconds(150));
}

TEST(TimeLeft, OfCandidatesHasTheAnswerInIt) {
  TimeLeft time(kExpected);
  time.take_candidates(5, 2);
  EXPECT_DOUBLE_EQ(*time.seconds(0), 2 * (5 + 20 + 3 * 10 + 2));
}

// The first look took half as long again as was expected: so will what follows.
TEST(TimeLeft, FollowsWhatThePartsTook) {
  TimeLeft time(kExpected);
  time.take_candidates(0, 2);
  time.begin(SearchStage::first_look, 1000);
  EXPECT_DOUBLE_EQ(*time.seconds(1010), 2 * (20 + 3 * 10 + 2) - 10);
  time.begin(SearchStage::lattice, 1060);
  EXPECT_DOUBLE_EQ(*time.seconds(1060), 3 * (3 * 10 + 2));
  time.begin(SearchStage::lattice, 1100);  // 40 s, not 30
  EXPECT_DOUBLE_EQ(*time.seconds(1100), 2 * 40 + 3 * 2);
  time.begin(SearchStage::end, 1140);
  EXPECT_DOUBLE_EQ(*time.seconds(1140), 3 * 2);
}

// As a rule one more follows, however many there were; and a stage that lasts longer than it should is not
// over.
TEST(TimeLeft, IsNeverNothing) {
  TimeLeft time(kExpected);
  time.take_candidates(0, 1);
  time.begin(SearchStage::first_look, 0);
  EXPECT_DOUBLE_EQ(*time.seconds(500), 2 + 30 + 2);
  for (const double at : {20, 30, 40, 50, 60}) time.begin(SearchStage::lattice, at);
  EXPECT_DOUBLE_EQ(*time.seconds(60), 10 + 10 + 2);
}

TEST(TimeLeft, IsToldByTheFirstLatticeWhereNoCandidateWasSimulated) {
  TimeLeft time(kExpected);
  time.begin(SearchStage::candidates, -5);
  time.begin(SearchStage::lattice, 0);
  time.begin(SearchStage::lattice, 30);
  EXPECT_DOUBLE_EQ(*time.seconds_each(), 3);
  EXPECT_DOUBLE_EQ(*time.seconds(30), 30 + 30 + 3 * 2);
}

// A search may have no lattices: of five parameters none is simulated about the answer.
TEST(TimeLeft, WithoutLatticesIsThatOfTheLook) {
  TimeLeft time({.first_look = 20, .lattice = 0, .lattices = 0, .end = 2});
  time.take_candidates(0, 1);
  time.begin(SearchStage::first_look, 0);
  EXPECT_DOUBLE_EQ(*time.seconds(5), 15 + 2);
}

/// A search as it was recorded, in seconds of the processor: two threads, 496 vertices, 301 steps.
struct Recorded {
  const char* name;
  ExpectedWork expected;  ///< by expected_work
  int candidates;
  double candidate_seconds, first_look;  ///< of one; when the first look began
  std::vector<double> lattices;          ///< when they began
  double end, over;
};

/// What was said at a time of it.
double said_at(const Recorded& search, double at) {
  TimeLeft time(search.expected);
  if (at < search.first_look) {
    time.take_candidates(search.candidates - at / search.candidate_seconds, search.candidate_seconds);
    return *time.seconds(at);
  }
  time.take_candidates(0, search.candidate_seconds);
  time.begin(SearchStage::first_look, search.first_look);
  for (const double lattice : search.lattices)
    if (lattice <= at) time.begin(SearchStage::lattice, lattice);
  if (search.end <= at) time.begin(SearchStage::end, search.end);
  return *time.seconds(at);
}

// How many lattices follow is not known: towards the end of a search with fewer or more it is off by more.
TEST(TimeLeft, OfRecordedSearchesIsWithinAFactorOfTwoFromTheFirstTenthOn) {
  const std::vector<Recorded> searches = {
      {"demo", {53, 52, 2.5, 7.3}, 27, 0.64, 17.3, {69.1, 93.3, 116.9, 157.0}, 195.6, 199.9},
      {"3 candidates", {48, 37, 1.5, 7.3}, 3, 0.73, 2.2, {42.0}, 57.3, 60.5},
      {"270 candidates", {53, 52, 2.5, 7.3}, 270, 0.637, 172.2, {223.1}, 261.1, 264.9}};
  for (const Recorded& search : searches)
    for (const int tenth : {1, 2, 3, 4}) {
      const double at = 0.1 * tenth * search.over, left = search.over - at, said = said_at(search, at);
      EXPECT_GT(said, left / 2) << search.name << ' ' << tenth;
      EXPECT_LT(said, left * 2) << search.name << ' ' << tenth;
    }
}

TEST(TimeLeft, SimulationsSideBySideTakeAsLongAsTheirSumOrTheLongest) {
  EXPECT_DOUBLE_EQ(time_together({{6, 1}, {2, 3}}, 2), 12);
  EXPECT_DOUBLE_EQ(time_together({{1, 1}, {1, 8}}, 2), 16);
  EXPECT_DOUBLE_EQ(time_together({{0, 100}}, 2), 0);
}

}  // namespace
}  // namespace flash::sysid
