#include "sysid/predictability.h"

#include <gtest/gtest.h>

namespace flash::sysid {
namespace {

GridResults two_keyframes() {
  CandidateResult candidate;
  candidate.recordings.resize(2);
  candidate.recordings[0].keyframes = {{1.0, 0.002, 100, 1}, {2.0, 0.008, 100, 1}};
  candidate.recordings[1].keyframes = {{1.0, 0.004, 100, 1}, {2.0, 0.006, 100, 1}};
  for (RecordingScore& recording : candidate.recordings) recording.score = 0.005;
  candidate.score = 0.005;
  GridResults results;
  results.candidates = {candidate};
  return results;
}

TEST(Predictability, ScoresAreFormedFromWhatIsPredictable) {
  GridResults results = two_keyframes();
  drop_beyond_horizons({1.5, std::nullopt}, results);
  const CandidateResult& candidate = results.candidates[0];
  EXPECT_DOUBLE_EQ(candidate.recordings[0].score, 0.002);
  EXPECT_EQ(candidate.recordings[0].keyframes[1].weight, 0);
  EXPECT_DOUBLE_EQ(candidate.recordings[1].score, 0.005);
  EXPECT_DOUBLE_EQ(candidate.score, 0.0035);
}

TEST(Predictability, ARecordingIsNeverLeftWithoutKeyframes) {
  GridResults results = two_keyframes();
  drop_beyond_horizons({0.5, 0.5}, results);
  EXPECT_DOUBLE_EQ(results.candidates[0].score, 0.005);
  Replay replay;
  replay.observations = {{1.0, data::Points::Zero(5, 3), 1}};
  drop_beyond_horizon(0.5, replay);
  EXPECT_EQ(replay.observations[0].weight, 1);
}

}  // namespace
}  // namespace flash::sysid
