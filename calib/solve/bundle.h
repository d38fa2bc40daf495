#pragma once
#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "calib/dataset/edge_offset.h"
#include "calib/dataset/observation.h"
#include "calib/dataset/target_shape.h"
#include "calib/geometry/arm_model.h"
#include "calib/geometry/chain.h"
#include "calib/geometry/closed_form.h"
#include "calib/geometry/pose.h"
#include "calib/solve/along_prior.h"
#include "calib/solve/lens_prior.h"
#include "data/camera/camera.h"

namespace flash::calib {

/// Where a robot said its gripper was, and how it was wrong.
struct RobotPose {
  int arm = 0;
  Eigen::Isometry3d T_base_gripper = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d correction = Eigen::Isometry3d::Identity();  ///< true pose = T_base_gripper * correction
  Vector6d velocity = Vector6d::Zero();  ///< of the gripper, in its frame [m/s, rad/s]; for the time offset
  Eigen::Matrix<double, 6, Eigen::Dynamic> joint_motions = {};  ///< as in Observation
};

/// One target in one image.
struct BundleView {
  int pose = 0, camera = 0, target = 0;
  Eigen::Matrix3Xd points;        ///< in the target frame [m]
  Eigen::Matrix2Xd pixels;        ///< where they were seen [px]
  double corner_noise = 1;        ///< of its corners, over that of the camera's (NoiseLevels::corner)
  Eigen::Matrix2Xd outward = {};  ///< how they move per pixel of the camera's edge offset; none: not at all
  Bows bows;                      ///< how far each point rises per unit of the target's warp (target_bows)
  Eigen::Matrix3Xd depth_points;  ///< on the target's plane, measured by depth, in the camera frame [m]; or
                                  ///< none
};

/// What is known before a picture is taken: normal distributions about what is stated.
struct Priors {
  std::vector<double> scale_sd = {};  ///< of each target's scale; empty: nothing
  /// Of each target: full standard deviation of the scale that the pictures tell, over that of noise alone.
  /// The prior weighs as much more against residuals that are taken for noise. Empty: 1.
  std::vector<double> caution = {};
  std::vector<LensPrior> lenses = {};    ///< of each camera; empty: nothing
  std::vector<double> warp_sd = {};      ///< of each number of each target's warp [m]; empty: flat
  std::optional<AlongPrior> along = {};  ///< of the first camera or target
};

/// Of a target's scale; infinity where nothing is known.
inline double known_scale_sd(const Priors& priors, std::size_t target) {
  return priors.scale_sd.empty() ? std::numeric_limits<double>::infinity() : priors.scale_sd[target];
}

/// The standard deviation that the prior of a target's scale has among residuals of noise.
inline double prior_scale_sd(const Priors& priors, std::size_t target) {
  return known_scale_sd(priors, target) / (priors.caution.empty() ? 1 : priors.caution[target]);
}

/// Everything that is known and looked for. One hand-eye calibration has one camera, arm and target; several
/// arms on one camera, or several cameras on one arm, share them (see Chain).
struct Bundle {
  Setup setup = Setup::eye_in_hand;
  std::vector<Eigen::Isometry3d> cameras;          ///< C: in the gripper (eye-in-hand) or the world
  std::vector<data::CameraIntrinsics> intrinsics;  ///< of each camera
  std::vector<Eigen::Isometry3d> bases;    ///< B: of each arm in the world, which is the first arm's base
  std::vector<Eigen::Isometry3d> targets;  ///< Z: in the world (eye-in-hand) or a gripper
  std::vector<double> scales;              ///< of each target: true size over stated size
  std::vector<Warp> warps = {};            ///< of each target, see target_bows(); empty: flat
  std::vector<double> edge_offsets = {};   ///< of each camera [px], see EdgeOffset; empty: 0
  std::vector<double> time_offsets;        ///< tau of each arm [s]
  /// Of each arm: joints are that much farther [rad], then links so much longer [m]; empty: 0.
  std::vector<Eigen::VectorXd> joint_errors = {};
  std::vector<Eigen::VectorXd> joint_error_sd = {};  ///< beforehand, of each of them
  std::vector<double> depth_scales = {};             ///< of each camera: depth over distance; empty: 1
  std::vector<Eigen::Vector3d> pivots;  ///< of each arm, in its gripper: where errors of rotation and of
                                        ///< translation are independent [m]
  std::vector<RobotPose> poses;
  std::vector<BundleView> views;
  Priors priors = {};
};

/// A view of some points of a target.
BundleView make_view(const Eigen::Matrix3Xd& target_points, const Observation& observation);

inline TargetShape shape_of(const Bundle& bundle, std::size_t target) {
  TargetShape shape{.scale = bundle.scales[target]};
  if (!bundle.warps.empty()) shape.warp = bundle.warps[target];
  return shape;
}

/// Where the points of a view are, in the target frame: of the target's true size and warp.
Eigen::Matrix3Xd true_points(const Bundle& bundle, const BundleView& view);

/// The bundle of one camera and one arm. points: the target's, 3 x N; poses: seed.
Bundle make_bundle(Setup setup, const data::CameraIntrinsics& camera, const Eigen::Matrix3Xd& target_points,
                   const std::vector<Observation>& observations, const HandEyePoses& seed);

/// Adds a view that does not fit to a solution of one camera and arm: its pose is corrected to where its
/// corners say.
void append_view(Bundle& bundle, const Eigen::Matrix3Xd& target_points, const Observation& observation);

/// The bundle with the views of the poses whose `fold` is `part`, or of all others.
Bundle views_of(const Bundle& bundle, const std::vector<int>& fold, int part, bool inside);

/// Where the points of a view would have been seen if edges stood where they are [px], 2 x N.
Eigen::Matrix2Xd true_pixels(const Bundle& bundle, const BundleView& view);

/// By how much edges stand outwards in the pictures of a camera [px].
inline double edge_offset(const Bundle& bundle, std::size_t camera) {
  return bundle.edge_offsets.empty() ? 0 : bundle.edge_offsets[camera];
}

/// Whether any view of a camera has corners of edges.
bool sees_edges(const Bundle& bundle, std::size_t camera);

/// Depth over distance of a camera.
inline double depth_scale(const Bundle& bundle, std::size_t camera) {
  return bundle.depth_scales.empty() ? 1 : bundle.depth_scales[camera];
}

/// Deviations beforehand of the errors of an observation's joints.
Eigen::VectorXd joint_error_sd(const Observation& observation);

/// What is known of the errors of an arm's joints beforehand, beside r = error / sd of each:
///
///     cost = kJointErrorTail log(1 + r^2 / kJointErrorTail),
///
/// near zero that of a normal distribution, far out Student's: a joint or a link that is grossly off, or a
/// description of another arm, is found and does not bend the others.
constexpr double kJointErrorTail = 4;

/// Of the errors as they are, the inverse variances that this is worth [rad^-2, then m^-2].
Eigen::VectorXd joint_error_weights(const Bundle& bundle, std::size_t arm);

/// What a pose needs for the errors of its arm's joints, to first order: the mean that its correction
/// scatters about.
Eigen::Isometry3d usual_correction(const Bundle& bundle, const RobotPose& pose);

/// The closed chain through one view, with the correction of the robot's pose or without.
Chain chain_of(const Bundle& bundle, const BundleView& view, bool corrected = true);

/// Pose of the target in the camera, with the correction of the robot's pose or without.
Eigen::Isometry3d predicted_pose(const Bundle& bundle, const BundleView& view, bool corrected = true);

/// Seen minus projected [px], 2 x N, edges put where they are.
Eigen::Matrix2Xd residuals(const Bundle& bundle, const BundleView& view, bool corrected = true);

/// 2-D rms per corner over all views [px].
double reprojection_rms(const Bundle& bundle, bool corrected = true);

}  // namespace flash::calib
