#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "calib/dataset/observation.h"
#include "calib/geometry/chain.h"
#include "calib/geometry/pose.h"
#include "data/camera.h"

namespace flash::calib {

/// Where a robot said its gripper was, and how it was wrong.
struct RobotPose {
  int arm = 0;
  Eigen::Isometry3d T_base_gripper = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d correction = Eigen::Isometry3d::Identity();  ///< true pose = T_base_gripper * correction
  Vector6d velocity = Vector6d::Zero();  ///< of the gripper, in its frame [m/s, rad/s]; for the time offset
};

/// One target in one image.
struct BundleView {
  int pose = 0, camera = 0, target = 0;
  Eigen::Matrix3Xd points;        ///< in the target frame [m]
  Eigen::Matrix2Xd pixels;        ///< where they were seen [px]
  Eigen::Matrix3Xd depth_points;  ///< on the target's plane, measured by depth, in the camera frame [m]; or
                                  ///< none
};

/// Everything that is known and looked for. One hand-eye calibration has one camera, arm and target; several
/// arms on one camera, or several cameras on one arm, share them (see Chain).
struct Bundle {
  Setup setup = Setup::eye_in_hand;
  std::vector<Eigen::Isometry3d> cameras;          ///< C: in the gripper (eye-in-hand) or the world
  std::vector<data::CameraIntrinsics> intrinsics;  ///< of each camera
  std::vector<Eigen::Isometry3d> bases;    ///< B: of each arm in the world, which is the first arm's base
  std::vector<Eigen::Isometry3d> targets;  ///< Z: in the world (eye-in-hand) or a gripper
  std::vector<double> scales;              ///< of each target: true size over stated size
  std::vector<double> time_offsets;        ///< tau of each arm [s]
  std::vector<double> depth_scales = {};   ///< of each camera: depth over distance; empty: 1
  std::vector<Eigen::Vector3d> pivots;     ///< of each arm, in its gripper: where errors of rotation and of
                                           ///< translation are independent [m]
  std::vector<RobotPose> poses;
  std::vector<BundleView> views;
};

/// Standard deviations per axis, of every camera or arm.
struct NoiseLevels {
  std::vector<double> corner;       ///< of a corner, per camera [px]
  std::vector<double> rotation;     ///< of a robot pose, per arm [rad]
  std::vector<double> translation;  ///< of a robot pose, per arm [m]
  std::vector<double> depth;        ///< of a depth, per camera [m]
};

/// What may change. The first arm's base never does.
struct Unknowns {
  bool corrections = true;  ///< of robot poses, held by a prior of their noise: errors in variables
  int intrinsics = 0;       ///< how many of fx fy cx cy k1 k2 p1 p2 k3 ...
  bool scales = false;
  bool time_offsets = false;
  bool depth_scales = true;  ///< of cameras with depth: it tells shape and tilt, not how long a metre is
};

struct BundleSettings {
  Unknowns unknowns;
  double huber = 3.5;  ///< of a corner's residual, in its standard deviations; 0: squares throughout
  int iterations = 100;
  double tolerance = 1e-10;  ///< relative change of the cost
};

struct BundleSummary {
  double cost = 0;  ///< half the sum of squares over their variances
  int iterations = 0;
  bool converged = false;
};

/// Minimises the sum over all corners of rho(|pixel - project(q)|^2 / corner^2) and, with corrections D, the
/// prior |dt|^2 / translation^2 + |dtheta|^2 / rotation^2 of each, dt being the motion of the arm's pivot.
/// Levenberg-Marquardt on the manifold; the corrections are eliminated first.
BundleSummary solve_bundle(Bundle& bundle, const NoiseLevels& noise, const BundleSettings& settings = {});

/// Depth over distance of a camera.
inline double depth_scale(const Bundle& bundle, std::size_t camera) {
  return bundle.depth_scales.empty() ? 1 : bundle.depth_scales[camera];
}

/// The closed chain through one view, with the correction of the robot's pose or without.
Chain chain_of(const Bundle& bundle, const BundleView& view, bool corrected = true);

/// Pose of the target in the camera, with the correction of the robot's pose or without.
Eigen::Isometry3d predicted_pose(const Bundle& bundle, const BundleView& view, bool corrected = true);

/// Seen minus projected [px], 2 x N.
Eigen::Matrix2Xd residuals(const Bundle& bundle, const BundleView& view, bool corrected = true);

/// 2-D rms per corner over all views [px].
double reprojection_rms(const Bundle& bundle, bool corrected = true);

}  // namespace flash::calib
