#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "data/camera/camera.h"

namespace flash::calib {

/// A pose of a flat target and how well it fits.
struct PlanarPose {
  Eigen::Isometry3d T_camera_target;
  double rms = 0;  ///< reprojection, 2-D rms per point [px]
};

/// Poses that fit a flat target (points 3 x N, z = 0, [m]; pixels distorted), best first: both of the local
/// minima that perspective leaves (Collins and Bartoli 2014), each refined on the reprojection. One where
/// they fall together or the second lies behind the camera; none where fewer than four points are given, or
/// all on a line.
std::vector<PlanarPose> planar_poses(const data::CameraIntrinsics& camera, const Eigen::Matrix3Xd& points,
                                     const Eigen::Matrix2Xd& pixels);

}  // namespace flash::calib
