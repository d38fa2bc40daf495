#pragma once
#include <Eigen/Geometry>
#include <string>
#include <vector>

namespace flash::calib {

enum class Setup {
  eye_in_hand,  ///< the camera rides on the gripper, the target stands still: X = T_gripper_camera, Z =
                ///< T_base_target
  eye_to_hand   ///< the camera stands still, the gripper holds the target: X = T_base_camera, Z =
                ///< T_gripper_target
};

/// What one view saw of the target, and where the robot said its gripper was.
struct Observation {
  std::string image;  ///< file name, for messages and the report
  Eigen::Isometry3d T_base_gripper = Eigen::Isometry3d::Identity();
  std::vector<int> points;                         ///< columns of target_points that were seen
  Eigen::Matrix2Xd pixels;                         ///< where [px], distorted; pixel centres are whole numbers
  std::vector<Eigen::Isometry3d> T_camera_target;  ///< poses that fit, best first: a flat target may have two
  double pose_rms = 0;                 ///< reprojection of the first of them, 2-D rms per point [px]
  Eigen::Matrix3Xd depth_points = {};  ///< on the target's plane by depth, camera frame [m]; or none
  Eigen::Matrix<double, 6, 1> velocity =
      Eigen::Matrix<double, 6, 1>::Zero();  ///< of the gripper, in its frame [m/s, rad/s]; of a stream
};

}  // namespace flash::calib
