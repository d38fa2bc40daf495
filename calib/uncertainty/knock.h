#pragma once
#include <optional>
#include <vector>

#include "calib/solve/errors_in_variables.h"

namespace flash::calib {

/// Something that should not have moved between two views did: the target or the camera.
struct Knock {
  std::size_t pose = 0;                ///< the first after it
  bool camera = false;                 ///< the camera moved; else the target
  Vector6d motion = Vector6d::Zero();  ///< of its frame, (dt, dtheta) [m, rad]
  bool told = true;                    ///< which of the two: the other is less likely than 1 in 20
  double gain = 0;  ///< fall of -2 log likelihood, less what so many unknowns more have to earn
};

/// Looks for one step of camera or target, over all times at which enough views stand on both sides. Poses
/// are in the order of time. The step's six unknowns are added to the linearised solution; its likelihood is
/// that of robot errors that become as much smaller. It has to earn log(n) each (Schwarz 1978), its time and
/// kind and the rarity of knocks, 1 in 20, as well. rival: the fall of -2 log likelihood by errors that are
/// smooth over the poses, which explain a recording without a knock. A step that is no larger than what
/// errors of 0.1 deg put between two halves is none.
std::optional<Knock> find_knock(const Refinement& refined, const BundleSettings& settings, double rival);

}  // namespace flash::calib
