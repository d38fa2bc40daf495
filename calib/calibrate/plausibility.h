#pragma once
#include <string>
#include <vector>

#include "calib/calibrate/calibrate.h"

namespace flash::calib {

/// What an answer must do to be one, whatever its own convergence says. Lengths count as shares of the
/// distance to the target, in radians.
struct PlausibilitySettings {
  double deviation = 0.1;  ///< of the camera's place, rms an axis over the distance; of its turn [rad]
  double noise = 0.5;  ///< of the robot's poses over their motion; of its places alone, from `deviation` on
  double held_out = 0.5;  ///< residual of views left out over that of taking the target to stand still
};

/// Empty, or one sentence that says why robot and camera do not tell of the same motion. used: views in the
/// solution.
std::string implausibility(const Calibration& calibration, const std::vector<Observation>& used,
                           const PlausibilitySettings& settings = {});

/// The part that is known before views are left out: whether the robot would have to be wrong by about as
/// much as it moved.
std::string implausible_noise(const NoiseLevels& noise, const std::vector<Observation>& used,
                              const PlausibilitySettings& settings = {});

}  // namespace flash::calib
