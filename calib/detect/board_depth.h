#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/dataset/observation.h"
#include "data/camera/camera.h"
#include "data/camera/depth_map.h"

namespace flash::calib {

/// Pixels of a picture of that size within the convex outline of the corners seen, row by row.
std::vector<Eigen::Vector2i> pixels_within(const Eigen::Matrix2Xd& corners, int width, int height);

/// What depth says of a flat target in one view. A plane has three unknowns, so all its pixels are brought
/// down to three places, whose depths on the fitted plane are independent and carry what the pixels know
/// together. Neighbouring pixels of a depth camera err alike, and a view as a whole is off by more than its
/// pixels scatter: three numbers a view leave it to the views to show how far depth can be trusted.
struct BoardDepth {
  Eigen::Matrix3Xd points;  ///< three, camera frame [m]; none where fewer than 50 pixels have depth
  double noise = 0;         ///< of a single pixel along its ray: rms from the plane [m]
  int pixels = 0;           ///< that the plane was fitted to, flying ones left out
};

/// Least squares of the depths, z = 1 / (a + b x + c y) on normalised rays (x, y, 1), pixels beyond four
/// robust standard deviations left out; at most about 5,000 pixels, evenly spread. Throws data::InputError
/// naming the view where the sizes of depth and camera differ.
BoardDepth board_depth(const data::DepthMap& depth, const data::CameraIntrinsics& camera,
                       const Observation& view);

/// Throws data::InputError naming the view unless the depth picture is as large as the camera's.
void expect_registered(const data::DepthMap& depth, const data::CameraIntrinsics& camera,
                       const std::string& image);

/// Measured distance over that of the pose which the corners give, mean over the three places.
double depth_over_pose(const Eigen::Matrix3Xd& points, const Eigen::Isometry3d& T_camera_target);

}  // namespace flash::calib
