#include <cmath>

#include "calib/geometry/chain.h"
#include "calib/geometry/projection.h"
#include "calib/solve/bundle_adjustment.h"

namespace flash::calib {

Eigen::Isometry3d predicted_pose(const Bundle& bundle, const BundleView& view, bool corrected) {
  return chain_of(bundle, view, corrected).target_in_camera();
}

Chain chain_of(const Bundle& bundle, const BundleView& view, bool corrected) {
  const RobotPose& pose = bundle.poses[static_cast<std::size_t>(view.pose)];
  const auto arm = static_cast<std::size_t>(pose.arm);
  return {bundle.setup,
          bundle.cameras[static_cast<std::size_t>(view.camera)],
          bundle.bases[arm],
          pose.T_base_gripper,
          corrected ? pose.correction : Eigen::Isometry3d::Identity(),
          bundle.targets[static_cast<std::size_t>(view.target)],
          bundle.time_offsets[arm],
          pose.velocity};
}

Eigen::Matrix2Xd residuals(const Bundle& bundle, const BundleView& view, bool corrected) {
  const Eigen::Isometry3d T = predicted_pose(bundle, view, corrected);
  const IntrinsicsVector intrinsics = to_vector(bundle.intrinsics[static_cast<std::size_t>(view.camera)]);
  const double scale = bundle.scales[static_cast<std::size_t>(view.target)];
  Eigen::Matrix2Xd result(2, view.points.cols());
  for (Eigen::Index i = 0; i < view.points.cols(); ++i)
    result.col(i) = view.pixels.col(i) - project(intrinsics, T * (scale * view.points.col(i)));
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
