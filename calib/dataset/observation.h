#pragma once
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "calib/geometry/closed_form.h"
#include "calib/geometry/setup.h"

namespace flash::calib {

/// What one view saw of the target, and where the robot said its gripper was.
struct Observation {
  std::string image;  ///< file name, for messages and the report
  Eigen::Isometry3d T_base_gripper = Eigen::Isometry3d::Identity();
  std::vector<int> points;                         ///< columns of target_points that were seen
  Eigen::Matrix2Xd pixels;                         ///< where [px], distorted; pixel centres are whole numbers
  Eigen::Matrix2Xd outward = {};                   ///< of them, see outward_motion(); or none
  std::vector<Eigen::Isometry3d> T_camera_target;  ///< poses that fit, best first: a flat target may have two
  double corner_noise = 1;                         ///< of its corners, over that of most views
  double pose_rms = 0;                 ///< reprojection of the first of them, 2-D rms per point [px]
  Eigen::Matrix3Xd depth_points = {};  ///< on the target's plane by depth, camera frame [m]; or none
  Eigen::Matrix<double, 6, 1> velocity =
      Eigen::Matrix<double, 6, 1>::Zero();  ///< of the gripper, in its frame [m/s, rad/s]; of a stream
  Eigen::Matrix<double, 6, Eigen::Dynamic> joint_motions =
      {};                         ///< as joint_motions() or error_motions(), where joints are known
  Eigen::VectorXd joint_sd = {};  ///< as prior_deviations(), of each of these; empty: kUsualJointZero
};

/// The closed chain through each view, with the first pose of its target.
std::vector<PoseLoop> pose_loops(Setup setup, const std::vector<Observation>& observations);

}  // namespace flash::calib
