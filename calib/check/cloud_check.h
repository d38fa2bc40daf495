#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "calib/dataset/observation.h"
#include "calib/dataset/target.h"
#include "calib/detect/grey_image.h"
#include "data/camera/camera.h"
#include "data/camera/depth_map.h"
#include "data/picture/picture.h"

namespace flash::calib {

/// What a depth camera measured of the target in one view: points on the print, and how bright they are.
struct TargetCloud {
  std::string image;
  Eigen::Matrix3Xd points;           ///< camera frame [m]
  std::vector<std::uint8_t> colour;  ///< of each point
  Eigen::Matrix3Xd corners;  ///< the corners seen, at the depth of the plane of `points`, camera frame [m]
  std::vector<int> corner_ids;
};

/// Points within the outline of the corners seen. Empty where fewer than 50
/// pixels have depth. Throws data::InputError naming the view where sizes differ.
TargetCloud target_cloud(const data::DepthMap& depth, const GreyImage& image,
                         const data::CameraIntrinsics& camera, const Observation& view);

struct CloudView {
  std::string image;
  double offset_mm = 0;  ///< mean signed distance from the common plane
  double tilt_deg = 0;   ///< of its own plane against the common one
  double noise_mm = 0;   ///< rms distance of its points from its own plane
  double shift_mm = 0;   ///< of its corners along the common plane, rms against their means over the views
  int points = 0;
};

/// All views laid on each other in the frame in which the target rests: the base (eye-in-hand) or the
/// gripper.
struct CloudCheck {
  std::vector<CloudView> views;
  double thickness_mm = 0;  ///< rms distance of all points from their common plane
  double noise_mm =
      0;  ///< the same of each view from its own: what the thickness would be without errors of pose
  double offset_mm = 0;  ///< rms of the views' offsets
  double shift_mm = 0;   ///< rms over all corners, along the plane: how sharp the pattern is
  double trimmed = 0;    ///< share of points left out as flying pixels, beyond four sigma
  data::Picture pattern{1, 1, {0, 0, 0}};  ///< mean brightness on the common plane
  data::Picture profile{1, 1, {0, 0, 0}};  ///< seen along the plane, views in colours, heights magnified
};

/// X as in Setup. Throws data::InputError where fewer than two views have points.
CloudCheck check_clouds(Setup setup, const Eigen::Isometry3d& X, const std::vector<TargetCloud>& clouds,
                        const std::vector<Eigen::Isometry3d>& T_base_gripper);

}  // namespace flash::calib
