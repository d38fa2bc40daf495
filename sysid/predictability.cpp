#include "sysid/predictability.h"

#include "sysid/surface_change.h"

namespace flash::sysid {
namespace {

// Weighted mean of the keyframes that carry points; empty where none does.
std::optional<double> mean_score(const std::vector<KeyframeScore>& keyframes) {
  double sum = 0, weight = 0;
  for (const KeyframeScore& keyframe : keyframes) {
    if (keyframe.points == 0) continue;
    sum += keyframe.weight * keyframe.score;
    weight += keyframe.weight;
  }
  if (weight > 0) return sum / weight;
  return std::nullopt;
}

}  // namespace

std::optional<double> predictability_horizon(const Replay& replay, const ReplayCandidate& candidate,
                                             double limit, double perturbation) {
  ReplayCandidate twin = candidate;
  twin.material.membrane_stiffness *= 1 + perturbation;
  twin.material.bending_rigidity *= 1 + perturbation;
  twin.material.friction *= 1 + perturbation;
  const std::vector<ReplayResult> results = run(replay, {candidate, twin});
  for (const auto& [t, distance] : surface_change(replay, results[0].motion, results[1].motion))
    if (!(distance <= limit)) return t;
  return std::nullopt;
}

void drop_beyond_horizons(const std::vector<std::optional<double>>& horizons, GridResults& results) {
  for (CandidateResult& candidate : results.candidates) {
    if (candidate.status == CandidateStatus::diverged) continue;
    candidate.score = 0;
    for (std::size_t r = 0; r < candidate.recordings.size(); ++r) {
      RecordingScore& recording = candidate.recordings[r];
      std::vector<KeyframeScore> kept = recording.keyframes;
      for (KeyframeScore& keyframe : kept)
        if (horizons[r] && keyframe.t >= *horizons[r]) keyframe.weight = 0;
      if (const auto score = mean_score(kept)) {
        recording.keyframes = std::move(kept);
        recording.score = *score;
      }
      candidate.score += recording.score / static_cast<double>(candidate.recordings.size());
    }
  }
}

void drop_beyond_horizon(std::optional<double> horizon, Replay& replay) {
  if (!horizon) return;
  std::vector<Observation> kept = replay.observations;
  double weight = 0;
  for (Observation& observation : kept) {
    if (observation.t >= *horizon) observation.weight = 0;
    if (observation.seen()) weight += observation.weight;
  }
  if (weight > 0) replay.observations = std::move(kept);
}

}  // namespace flash::sysid
