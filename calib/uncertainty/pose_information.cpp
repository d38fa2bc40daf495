#include "calib/uncertainty/pose_information.h"

#include <cmath>

#include "calib/solve/linearization.h"

namespace flash::calib {

std::vector<PoseInformation> pose_informations(const Refinement& refined, const BundleSettings& settings) {
  constexpr int kOwn = 6;
  const LinearModel model = linearize(refined.bundle, refined.noise, settings);
  const std::vector<double> sigmas = to_components(refined.noise);
  const int seen = 2 * static_cast<int>(refined.bundle.cameras.size());  // corners and depths come first
  const Eigen::Index s = model.shared;
  std::vector<Eigen::MatrixXd> joint(static_cast<std::size_t>(model.groups),
                                     Eigen::MatrixXd::Zero(kOwn + s + 1, kOwn + s + 1));
  std::vector<PoseInformation> result(joint.size());
  for (const GramBlock& block : model.blocks) {
    const auto pose = static_cast<std::size_t>(block.group);
    const double weight = std::pow(sigmas[static_cast<std::size_t>(block.component)], -2);
    if (block.component < seen)
      joint[pose] += weight * block.gram;
    else
      result[pose].prior += weight * block.gram.topLeftCorner<kOwn, kOwn>();
  }
  for (std::size_t i = 0; i < joint.size(); ++i) {
    const RobotPose& pose = refined.bundle.poses[i];
    Vector6d xi;
    xi << pose.correction.translation(), rotation_log(pose.correction.linear());
    Matrix6d turn = Matrix6d::Zero();
    turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = pose.T_base_gripper.linear();
    const Eigen::MatrixXd& G = joint[i];
    PoseInformation& info = result[i];
    info.H = turn * G.topLeftCorner<kOwn, kOwn>() * turn.transpose();
    info.H_s = turn * G.block(0, kOwn, kOwn, s);
    info.H_ss = G.block(kOwn, kOwn, s, s);
    // Linearised at the correction found, asked of the whole error.
    info.g = turn * (G.block(0, kOwn + s, kOwn, 1) - G.topLeftCorner<kOwn, kOwn>() * xi);
    info.g_s = G.block(kOwn, kOwn + s, s, 1) - G.block(kOwn, 0, s, kOwn) * xi;
    info.prior = (turn * info.prior * turn.transpose()).eval();
  }
  return result;
}

}  // namespace flash::calib
