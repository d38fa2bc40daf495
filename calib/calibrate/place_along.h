#pragma once
#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "calib/geometry/closed_form.h"
#include "calib/solve/along_prior.h"
#include "calib/uncertainty/one_axis.h"

namespace flash::calib {

/// Where camera or target was measured to be along the axis that a robot turns about: of the camera in the
/// base (eye-to-hand) or the gripper, of the target in the other one.
struct MeasuredHeight {
  bool target = false;  ///< else of the camera
  double height = 0;    ///< along the axis, its largest part positive [m]
  double sd = 1e-3;     ///< [m]
};

/// The one number that turns about one axis do not tell.
struct PlaceAlong {
  OneAxis axis;
  bool told = true;                             ///< by turns about other axes, or as it was measured
  double sd = 0;                                ///< of the camera along the axis, where it is told [m]
  std::optional<MeasuredHeight> measured = {};  ///< by which it is told
};

/// Stands in the covariance for what is not told [m].
constexpr double kUntoldSd = 10;

/// What a solution begins with, so that it has a place along the axis at all: near the seed's, by about the
/// distance to the target [m].
AlongPrior loose_along(const OneAxis& axis, const HandEyePoses& seed, double distance);

/// Decides, by a solution with the prior `loose`, whether the turns tell the place: to a tenth of the
/// distance to the target, as any answer has to. covariance: of X. Turns that are noise of the robot's poses
/// seem to tell it, and do so with an error of `lever` [m], how far from the gripper the robot's errors may
/// turn. Returns what to hold the solution at, by 10 um: where it was measured, or, if the turns do not tell
/// it, where the solution began.
struct SettledPlace {
  PlaceAlong place;
  std::optional<AlongPrior> hold = {};
};
SettledPlace settle_along(const OneAxis& axis, const AlongPrior& loose, const HandEyePoses& poses,
                          const Matrix6d& covariance, double rotation_noise, double lever, double distance,
                          const std::optional<MeasuredHeight>& measured);

/// Camera and target, moved along the axis to where they are held.
HandEyePoses moved_to(const AlongPrior& hold, const OneAxis& axis, HandEyePoses poses);

/// What a covariance of X has to hold besides: of a place that is not told, (10 m)^2.
Matrix6d covariance_along(const PlaceAlong& place, const Eigen::Isometry3d& X);

/// "the camera's place along (0.00, 0.00, 1.00) of the base is not told: ..."
std::string untold_sentence(const PlaceAlong& place, Setup setup);

}  // namespace flash::calib
