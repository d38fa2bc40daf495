#include "calib/solve/bundle.h"

#include <algorithm>
#include <cmath>

#include "calib/geometry/pose_from_pixels.h"
#include "calib/geometry/projection.h"

namespace flash::calib {

BundleView make_view(const Eigen::Matrix3Xd& target_points, const Observation& observation) {
  BundleView view;
  view.points = target_points(Eigen::all, observation.points);
  view.bows = target_bows(target_points)(Eigen::all, observation.points);
  view.pixels = observation.pixels;
  view.corner_noise = observation.corner_noise;
  view.outward = observation.outward;
  view.depth_points = observation.depth_points;
  return view;
}

Eigen::Matrix3Xd true_points(const Bundle& bundle, const BundleView& view) {
  return shaped(view.points, view.bows, shape_of(bundle, static_cast<std::size_t>(view.target)));
}

Eigen::Matrix2Xd true_pixels(const Bundle& bundle, const BundleView& view) {
  if (view.outward.cols() == 0) return view.pixels;
  return view.pixels - edge_offset(bundle, static_cast<std::size_t>(view.camera)) * view.outward;
}

bool sees_edges(const Bundle& bundle, std::size_t camera) {
  return std::any_of(bundle.views.begin(), bundle.views.end(), [&](const BundleView& view) {
    return view.camera == static_cast<int>(camera) && view.outward.cols() > 0;
  });
}

Bundle make_bundle(Setup setup, const data::CameraIntrinsics& camera, const Eigen::Matrix3Xd& target_points,
                   const std::vector<Observation>& observations, const HandEyePoses& seed) {
  Bundle bundle{.setup = setup,
                .cameras = {seed.X},
                .intrinsics = {camera},
                .bases = {Eigen::Isometry3d::Identity()},
                .targets = {seed.Z},
                .scales = {1.0},
                .time_offsets = {0.0},
                .pivots = {Eigen::Vector3d::Zero()},
                .poses = {},
                .views = {}};
  if (!observations.empty() && observations.front().joint_motions.cols() > 0) {
    bundle.joint_error_sd = {joint_error_sd(observations.front())};
    bundle.joint_errors = {Eigen::VectorXd::Zero(bundle.joint_error_sd.front().size())};
  }
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const Observation& observation = observations[i];
    RobotPose pose;
    pose.T_base_gripper = observation.T_base_gripper;
    pose.velocity = observation.velocity;
    pose.joint_motions = observation.joint_motions;
    bundle.poses.push_back(pose);
    BundleView view = make_view(target_points, observation);
    view.pose = static_cast<int>(i);
    bundle.views.push_back(std::move(view));
  }
  return bundle;
}

void append_view(Bundle& bundle, const Eigen::Matrix3Xd& target_points, const Observation& observation) {
  BundleView view = make_view(target_points, observation);
  view.pose = static_cast<int>(bundle.poses.size());
  RobotPose pose;
  pose.T_base_gripper = observation.T_base_gripper;
  pose.velocity = observation.velocity;
  pose.joint_motions = observation.joint_motions;
  const Eigen::Isometry3d T = fitted_pose(bundle.intrinsics.front(), true_points(bundle, view),
                                          true_pixels(bundle, view), observation.T_camera_target.front());
  const Eigen::Isometry3d &X = bundle.cameras.front(), &Z = bundle.targets.front();
  pose.correction =
      pose.T_base_gripper.inverse() *
      (bundle.setup == Setup::eye_in_hand ? Z * T.inverse() * X.inverse() : X * T * Z.inverse());
  bundle.poses.push_back(pose);
  bundle.views.push_back(std::move(view));
}

Bundle views_of(const Bundle& bundle, const std::vector<int>& fold, int part, bool inside) {
  Bundle result = bundle;
  std::erase_if(result.views, [&](const BundleView& view) {
    return (fold[static_cast<std::size_t>(view.pose)] == part) != inside;
  });
  return result;
}

Eigen::Isometry3d predicted_pose(const Bundle& bundle, const BundleView& view, bool corrected) {
  return chain_of(bundle, view, corrected).target_in_camera();
}

Eigen::VectorXd joint_error_sd(const Observation& observation) {
  if (observation.joint_sd.size() > 0) return observation.joint_sd;
  return Eigen::VectorXd::Constant(observation.joint_motions.cols(), kUsualJointZero);
}

Eigen::VectorXd joint_error_weights(const Bundle& bundle, std::size_t arm) {
  const Eigen::ArrayXd sd = bundle.joint_error_sd[arm];
  return 1 / (sd.square() + bundle.joint_errors[arm].array().square() / kJointErrorTail);
}

Eigen::Isometry3d usual_correction(const Bundle& bundle, const RobotPose& pose) {
  if (bundle.joint_errors.empty() || pose.joint_motions.cols() == 0) return Eigen::Isometry3d::Identity();
  return moved(Eigen::Isometry3d::Identity(),
               pose.joint_motions * bundle.joint_errors[static_cast<std::size_t>(pose.arm)]);
}

Chain chain_of(const Bundle& bundle, const BundleView& view, bool corrected) {
  const RobotPose& pose = bundle.poses[static_cast<std::size_t>(view.pose)];
  const auto arm = static_cast<std::size_t>(pose.arm);
  return {bundle.setup,
          bundle.cameras[static_cast<std::size_t>(view.camera)],
          bundle.bases[arm],
          pose.T_base_gripper,
          corrected ? pose.correction : usual_correction(bundle, pose),
          bundle.targets[static_cast<std::size_t>(view.target)],
          bundle.time_offsets[arm],
          pose.velocity};
}

Eigen::Matrix2Xd residuals(const Bundle& bundle, const BundleView& view, bool corrected) {
  const Eigen::Isometry3d T = predicted_pose(bundle, view, corrected);
  const IntrinsicsVector intrinsics = to_vector(bundle.intrinsics[static_cast<std::size_t>(view.camera)]);
  const Eigen::Matrix3Xd points = true_points(bundle, view);
  Eigen::Matrix2Xd result = true_pixels(bundle, view);
  for (Eigen::Index i = 0; i < points.cols(); ++i) result.col(i) -= project(intrinsics, T * points.col(i));
  return result;
}

double reprojection_rms(const Bundle& bundle, bool corrected) {
  double sum = 0;
  Eigen::Index count = 0;
  for (const BundleView& view : bundle.views) {
    sum += residuals(bundle, view, corrected).squaredNorm();
    count += view.points.cols();
  }
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0;
}

}  // namespace flash::calib
