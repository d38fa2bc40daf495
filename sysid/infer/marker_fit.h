#pragma once
#include <optional>

#include "sysid/observe/score.h"
#include "sysid/replay/replay.h"

namespace flash::sysid {

/// How the estimate follows the markers of a recording, over those that were seen when it counts.
struct MarkerFit {
  int sightings = 0;  ///< of a marker at a time
  double miss = 0;    ///< from where a marker was seen to where it is simulated, root mean square [m]
  double motion = 0;  ///< from where a marker began to where it was seen, likewise [m]
  double noise = 0;   ///< stated standard deviation along each axis [m]

  /// The root mean square distance that noise alone passes once in twenty: chi^2 of three degrees of freedom
  /// a sighting [m].
  double most_noise() const;
  /// Whether noise explains what is missed.
  bool follows() const { return miss <= most_noise(); }
  /// Whether more than half of the motion is missed, which noise does not explain or the motion does not
  /// stand out from either. What moves as 1 / E moves half as far with twice the E: a miss of that size
  /// leaves not even a factor of two to tell.
  bool explains_nothing() const { return 2 * miss > motion && (!follows() || motion <= most_noise()); }
};

/// None without markers that were tracked.
std::optional<MarkerFit> marker_fit_of(const Replay& replay, const Motion& motion,
                                       const Registration& registration, double noise);

}  // namespace flash::sysid
