#pragma once
#include <Eigen/Geometry>

#include "data/camera/camera.h"

namespace flash::calib {

/// The pose that fits the pixels best, by Gauss and Newton from a pose nearby.
Eigen::Isometry3d fitted_pose(const data::CameraIntrinsics& camera, const Eigen::Matrix3Xd& points,
                              const Eigen::Matrix2Xd& pixels, Eigen::Isometry3d T_camera_target);

}  // namespace flash::calib
