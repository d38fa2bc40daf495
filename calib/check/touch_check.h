#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/calibrate/extrinsics.h"

namespace flash::calib {

/// A place that the robot's tool touched, and where the camera sees it.
struct TouchedPoint {
  Eigen::Vector3d place;  ///< of the tip, in the base [m]
  Eigen::Vector2d pixel;  ///< as in the picture, distorted [px]
};

/// Rows of a table with the header "x,y,z,u,v". Throws data::InputError naming file and line.
std::vector<TouchedPoint> load_touched_points(const std::string& path);

struct TouchSettings {
  double touch_sd = 1e-3;  ///< of the tip an axis: how well its place is known [m]
  double pixel_sd = 1;     ///< of a pixel an axis [px]
};

struct TouchedResidual {
  Eigen::Vector2d error = Eigen::Vector2d::Zero();  ///< pixel less the projection of the place [px]
  double across = 0;                                ///< of the place from the ray of the pixel [m]
};

struct TouchCheck {
  std::vector<TouchedResidual> points;
  double rms_px = 0, rms_across = 0;  ///< [px], [m]
  double expected_across = 0;         ///< root mean square that calibration, tip and pixel make likely [m]
  Eigen::Vector3d shift =
      Eigen::Vector3d::Zero();  ///< of the camera in the base, with which the points fit best [m]
  Eigen::Vector3d shift_sd = Eigen::Vector3d::Zero();  ///< of that, by the points alone [m]
  double chi_square = 0;                               ///< of all errors, two a point
  double chance = 1;         ///< that a right calibration would miss the points by more
  double shift_chance = 1;   ///< that one would be missed by more in the way in which a shift does it
  bool contradicts = false;  ///< one of the chances is below 0.5 %: of both together 1 %
  bool judges = false;       ///< the shift is known to ten times the deviation of a touch, in each axis
};

/// Residuals of places in the pictures of a camera beside the robot, against
///
///     S = J C J^T + diag(P touch_sd^2 P^T + pixel_sd^2 I),
///
/// C the covariance of the calibration, which all points share, J and P the derivatives of a pixel by the
/// camera's pose and by the place. The shift is judged by its score, of three degrees of freedom: many points
/// hide it in the sum of all errors (Rao 1948). The distance across the ray is at the depth of the place.
/// Throws data::InputError where the camera is on the gripper, has no lens, or a place lies behind it.
TouchCheck check_touched(const Extrinsics& extrinsics, const std::vector<TouchedPoint>& points,
                         const TouchSettings& settings, const std::string& path);

/// "the points are missed by 1.2 mm across the line of sight (2.1 px), where 1.4 mm are expected ...".
std::string describe(const TouchCheck& check);

}  // namespace flash::calib
