#include "sysid/emulate/grid_results.h"

#include <cmath>

namespace flash::sysid {

const char* to_string(CandidateStatus status) {
  switch (status) {
    case CandidateStatus::ok:
      return "ok";
    case CandidateStatus::unconverged:
      return "unconverged";
    case CandidateStatus::diverged:
      return "diverged";
  }
  return "";
}

int best_of(const GridResults& results) {
  int best = -1;
  for (std::size_t i = 0; i < results.candidates.size(); ++i)
    if (std::isfinite(results.candidates[i].score) &&
        (best < 0 || results.candidates[i].score < results.candidates[static_cast<std::size_t>(best)].score))
      best = static_cast<int>(i);
  return best;
}

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

}  // namespace flash::sysid
