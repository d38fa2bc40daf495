#pragma once
#include <cmath>
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

/// Noise of the robot's poses, an axis, that no arm has.
struct ArmNoise {
  double doubtful_m = 5e-3, doubtful_rad = 1 * M_PI / 180;   ///< is told
  double unusable_m = 10e-3, unusable_rad = 3 * M_PI / 180;  ///< is no answer
};

/// Empty, or one sentence that says how far the robot's poses would have to be wrong. `unusable` becomes true
/// where they are so by more than any arm.
std::string unusual_noise(const NoiseLevels& noise, bool& unusable, const ArmNoise& arm = {});

/// Likewise of pairs of poses, which do not tell the robot's noise from the camera's: one sentence that says
/// how large both are together.
std::string unusual_scatter(const NoiseLevels& noise, const ArmNoise& arm = {});

/// Empty, or one sentence that says how badly the place of `what` is known. covariance: of its pose, right
/// perturbation (dt, dtheta) [m, rad]; distance: from the camera to the target [m].
std::string unknown_place(const std::string& what, const Matrix6d& covariance, double distance,
                          const PlausibilitySettings& settings = {});

/// The part that is known before views are left out: whether the robot would have to be wrong by about as
/// much as it moved.
std::string implausible_noise(const NoiseLevels& noise, const std::vector<Observation>& used,
                              const PlausibilitySettings& settings = {});

}  // namespace flash::calib
