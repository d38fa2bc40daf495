#include "calib/check/opencv_closed_forms.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "calib/geometry/pose.h"

namespace flash::calib {
namespace {

struct Matrices {
  std::vector<cv::Mat> R, t;

  void add(const Eigen::Isometry3d& T) {
    cv::Mat rotation, translation;
    cv::eigen2cv(Eigen::Matrix3d(T.linear()), rotation);
    cv::eigen2cv(Eigen::Vector3d(T.translation()), translation);
    R.push_back(rotation);
    t.push_back(translation);
  }
};

Eigen::Isometry3d pose_of(const cv::Mat& R, const cv::Mat& t) {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
  cv::cv2eigen(R, rotation);
  cv::cv2eigen(t, translation);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = rotation;
  T.translation() = translation;
  return T;
}

HandEyePoses hand_eye(const std::vector<PoseLoop>& loops, cv::HandEyeCalibrationMethod method) {
  Matrices robot, target;
  for (const PoseLoop& loop : loops) {
    robot.add(loop.G);
    target.add(loop.C);
  }
  cv::Mat R, t;
  cv::calibrateHandEye(robot.R, robot.t, target.R, target.t, R, t, method);
  HandEyePoses poses{.X = pose_of(R, t), .Z = {}};
  std::vector<Eigen::Isometry3d> closed;
  for (const PoseLoop& loop : loops) closed.push_back(loop.G * poses.X * loop.C);
  poses.Z = mean_pose(closed);
  return poses;
}

/// OpenCV's world is our target, its base the frame that G X C = Z closes in: T_camera_target = X^-1 G^-1 Z.
HandEyePoses robot_world(const std::vector<PoseLoop>& loops, cv::RobotWorldHandEyeCalibrationMethod method) {
  Matrices target, robot;
  for (const PoseLoop& loop : loops) {
    target.add(loop.C);
    robot.add(loop.G.inverse());
  }
  cv::Mat R_base_world, t_base_world, R_gripper_camera, t_gripper_camera;
  cv::calibrateRobotWorldHandEye(target.R, target.t, robot.R, robot.t, R_base_world, t_base_world,
                                 R_gripper_camera, t_gripper_camera, method);
  return {pose_of(R_gripper_camera, t_gripper_camera).inverse(),
          pose_of(R_base_world, t_base_world).inverse()};
}

}  // namespace

std::vector<ReferenceMethod> reference_methods(const std::vector<PoseLoop>& loops) {
  std::vector<ReferenceMethod> methods;
  const auto add = [&](const char* name, const auto& solve) {
    ReferenceMethod method{.name = name, .poses = {}, .relative = {}};
    try {
      method.poses = solve();
      method.relative = relative_rms(loops, method.poses.X);
    } catch (const cv::Exception&) {
      method.wild = true;  // some refuse a motion they cannot use
    }
    if (!method.poses.X.matrix().allFinite() || !std::isfinite(method.relative.rotation)) method.wild = true;
    methods.push_back(method);
  };
  for (const auto& [name, method] : {std::pair{"tsai", cv::CALIB_HAND_EYE_TSAI},
                                     {"park", cv::CALIB_HAND_EYE_PARK},
                                     {"horaud", cv::CALIB_HAND_EYE_HORAUD},
                                     {"andreff", cv::CALIB_HAND_EYE_ANDREFF},
                                     {"daniilidis", cv::CALIB_HAND_EYE_DANIILIDIS}})
    add(name, [&, method = method] { return hand_eye(loops, method); });
  for (const auto& [name, method] :
       {std::pair{"shah", cv::CALIB_ROBOT_WORLD_HAND_EYE_SHAH}, {"li", cv::CALIB_ROBOT_WORLD_HAND_EYE_LI}})
    add(name, [&, method = method] { return robot_world(loops, method); });

  double rotation = std::numeric_limits<double>::infinity(), translation = rotation;
  for (const ReferenceMethod& method : methods) {
    if (method.wild) continue;
    rotation = std::min(rotation, method.relative.rotation);
    translation = std::min(translation, method.relative.translation);
  }
  constexpr double kWild = 3;
  for (ReferenceMethod& method : methods)
    method.wild = method.wild || method.relative.rotation > kWild * rotation + 1e-6 ||
                  method.relative.translation > kWild * translation + 1e-6;
  return methods;
}

}  // namespace flash::calib
