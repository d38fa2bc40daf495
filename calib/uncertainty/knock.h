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
  double gain = 0;    ///< fall of -2 log likelihood, less what so many unknowns more have to earn
  double second = 0;  ///< the same of this step and another, the best of all; no less than `gain`
};

/// Looks for one step of camera or target, over all times at which enough views stand on both sides. Poses
/// are in the order of time. The step's six unknowns have to earn log(n) each (Schwarz 1978), its time and
/// kind and the rarity of knocks, 1 in 20, as well. rival: the fall of -2 log likelihood by errors that are
/// smooth over the poses, which explain a recording without a knock. A step that is no larger than what
/// errors of 0.1 deg put between two halves is none.
std::optional<Knock> find_knock(const Refinement& refined, const BundleSettings& settings, double rival);

/// Camera or target moved all the time, at one speed over the views.
struct Drift {
  bool camera = false;  ///< the camera moved; else the target
  Vector6d motion =
      Vector6d::Zero();  ///< of its frame from the first view to the last, (dt, dtheta) [m, rad]
  bool told = true;      ///< which of the two: the other is less likely than 1 in 20
  double gain = 0;       ///< as that of a knock
};

/// Judged as a knock is. shape: where each pose stands in time, -1 for the first view to 0 for
/// the last.
std::optional<Drift> find_drift(const Refinement& refined, const BundleSettings& settings,
                                const std::vector<double>& shape, double rival);

/// What a motion that took all the time, and is not solved for, may have done to the answer.
struct SlowDrift {
  double probability = 0;                  ///< that there was one
  Vector6d motion = Vector6d::Zero();      ///< the likeliest, as Drift's
  Matrix6d covariance = Matrix6d::Zero();  ///< of X, against where it stands at the last view
};

/// Before any view is seen, camera and target each have moved once in 40 recordings, by a motion that is
/// normal in the metric of its own information, of the size that explains the views best (Zellner 1986,
/// George and Foster 2000). So what is added grows with the evidence from nothing on, and no threshold
/// decides.
SlowDrift slow_drift(const Refinement& refined, const BundleSettings& settings,
                     const std::vector<double>& shape, double rival);

}  // namespace flash::calib
