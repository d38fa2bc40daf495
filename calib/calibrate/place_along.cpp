#include "calib/calibrate/place_along.h"

#include <cmath>

#include "calib/calibrate/plausibility.h"
#include "calib/uncertainty/observability.h"

namespace flash::calib {

AlongPrior loose_along(const OneAxis& axis, const HandEyePoses& seed, double distance) {
  return {.axis = axis.camera, .place = axis.camera.dot(seed.X.translation()), .sd = distance};
}

SettledPlace settle_along(const OneAxis& axis, const AlongPrior& loose, const HandEyePoses& poses,
                          const Matrix6d& covariance, double rotation_noise, double lever, double distance,
                          const std::optional<MeasuredHeight>& measured) {
  constexpr double kHeld = 1e-5;  // [m]
  SettledPlace settled{.place = {.axis = axis}};
  PlaceAlong& place = settled.place;
  if (measured) {
    place.measured = measured;
    place.told = measured->sd < PlausibilitySettings{}.deviation * distance;
    place.sd = measured->sd;
    settled.hold = {.target = measured->target,
                    .axis = measured->target ? axis.target : axis.camera,
                    .place = measured->height,
                    .sd = kHeld};
    return settled;
  }
  const Vector6d direction = untold_direction(axis, poses.X);
  const double seeming = axis.noise_share(rotation_noise) * lever;
  const double whole = std::hypot(seeming, std::sqrt(direction.dot(covariance * direction)));
  place.told = whole < PlausibilitySettings{}.deviation * distance;
  place.sd = place.told ? seeming : 0;
  if (place.told) return settled;
  settled.hold = loose;
  settled.hold->sd = kHeld;
  return settled;
}

HandEyePoses moved_to(const AlongPrior& hold, const OneAxis& axis, HandEyePoses poses) {
  const double missing = hold.place - hold.axis.dot((hold.target ? poses.Z : poses.X).translation());
  const double camera = hold.target ? axis.sense * missing : missing;
  poses.X.translation() += camera * axis.camera;
  poses.Z.translation() += axis.sense * camera * axis.target;
  return poses;
}

Matrix6d covariance_along(const PlaceAlong& place, const Eigen::Isometry3d& X) {
  const Vector6d shift = (place.told ? place.sd : kUntoldSd) * untold_direction(place.axis, X);
  return shift * shift.transpose();
}

std::string untold_sentence(const PlaceAlong& place, Setup setup) {
  const bool in_hand = setup == Setup::eye_in_hand;
  return "the camera's place along " + text_of(place.axis.camera) + " of the " +
         (in_hand ? "gripper" : "base") + ", and with it the target's along " + text_of(place.axis.target) +
         " of the " + (in_hand ? "base" : "gripper") +
         ", is not told, as the robot turns about that axis alone: all else is; measure one of them, and add "
         "--camera-height or --target-height, or add views that tilt about another axis";
}

}  // namespace flash::calib
