#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "data/recording/recording.h"
#include "sysid/observe/score.h"

namespace flash::sysid {

struct RepeatabilitySettings {
  Robust robust{};
  double score_from = -1e300;     ///< keyframes before are left out [s]
  double score_to = 1e300;        ///< keyframes after are left out [s]
  int min_points = 20;            ///< keyframes of fewer points are left out
  int neighbours = 12;            ///< points of a cloud that its local plane is fitted to
  int points_per_keyframe = 200;  ///< evenly thinned for the fit of the registration; the distance uses all
};

/// How far one trial lies from another at a keyframe of the first.
struct TrialDistance {
  double time = 0;      ///< of the keyframe [s]
  double distance = 0;  ///< robust mean of the distances of its points [m]
  double seen = 0;      ///< share of its points where the other trial saw the cloth too
};

/// How far two trials of one experiment lie from each other.
struct Repeatability {
  double distance = 0;                   ///< mean over `keyframes` [m]
  std::vector<TrialDistance> keyframes;  ///< those of the first trial, then those of the second
  Registration registration;             ///< of the second trial to the first
  std::vector<std::string> bounds_hit;   ///< "offset_x", "yaw", "time", ...: the distance is too large then
};

/// The distance between two trials, by the measure of a score: points of a keyframe to the surface that the
/// other trial saw at the same time. That surface is the plane through the nearest points of its cloud.
/// Between two keyframes the distances to both are interpolated. A point counts where the other trial saw the
/// cloth within three times its spacing. Offset, yaw and clock of the second trial are fitted inside the
/// bounds of the first recording, so that the distance is that of shape and motion. Throws data::InputError
/// where the sheets are of two sizes or no keyframe is in common.
Repeatability measure_repeatability(const data::Recording& first, const data::Recording& second,
                                    const RepeatabilitySettings& settings);

}  // namespace flash::sysid
