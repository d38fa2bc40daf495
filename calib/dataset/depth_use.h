#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

namespace flash::calib {

/// How depth pictures take part in a calibration.
struct DepthUse {
  bool used = false;
  int views = 0;            ///< with depth on the target
  double scale = 0.001;     ///< metres a count
  double pixel_noise = 0;   ///< of a single pixel, rms from the view's plane [m]
  double over_corners = 1;  ///< distance by depth over distance by corners, as estimated
  double over_corners_sd = 0;
  double sigma = 0;         ///< noise of the plane's depth at one of three places, as estimated [m]
  std::string reason = {};  ///< why it was not used
  std::vector<std::string> unreadable = {};  ///< pictures without depth, with the reason
};

/// Depth of the target in each view, as points for the bundle; none where it is not to be used.
struct DepthViews {
  DepthUse use;
  std::vector<Eigen::Matrix3Xd> points;  ///< of each frame
};

}  // namespace flash::calib
