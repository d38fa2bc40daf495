#include "calib/check/opencv_closed_forms.h"

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

/// None where OpenCV refuses the motion.
template <class Solve, class Method>
ClosedForm closed_form(const char* name, Solve solve, Method method) {
  return {name, [solve, method](const std::vector<PoseLoop>& loops) -> std::optional<HandEyePoses> {
            try {
              return solve(loops, method);
            } catch (const cv::Exception&) {
              return std::nullopt;
            }
          }};
}

}  // namespace

std::vector<ClosedForm> opencv_closed_forms() {
  return {closed_form("tsai", hand_eye, cv::CALIB_HAND_EYE_TSAI),
          closed_form("park", hand_eye, cv::CALIB_HAND_EYE_PARK),
          closed_form("horaud", hand_eye, cv::CALIB_HAND_EYE_HORAUD),
          closed_form("andreff", hand_eye, cv::CALIB_HAND_EYE_ANDREFF),
          closed_form("daniilidis", hand_eye, cv::CALIB_HAND_EYE_DANIILIDIS),
          closed_form("shah", robot_world, cv::CALIB_ROBOT_WORLD_HAND_EYE_SHAH),
          closed_form("li", robot_world, cv::CALIB_ROBOT_WORLD_HAND_EYE_LI)};
}

}  // namespace flash::calib
