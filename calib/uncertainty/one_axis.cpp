#include "calib/uncertainty/one_axis.h"

#include <algorithm>
#include <cmath>

#include "calib/uncertainty/observability.h"

namespace flash::calib {

double OneAxis::noise_share(double rotation) const {
  // Two axes, of the difference of two poses.
  const double noise2 = 4 * rotation * rotation;
  return across2 > noise2 ? noise2 / across2 : 1;
}

std::optional<OneAxis> one_axis(Setup setup, const std::vector<Eigen::Isometry3d>& T_base_gripper) {
  constexpr double kWide = 10 * M_PI / 180, kShare = 0.25;
  const RotationDiversity diversity = rotation_diversity(T_base_gripper);
  if (!(diversity.spread[1] < std::min(kWide, kShare * diversity.spread[0]))) return std::nullopt;
  const Eigen::Vector3d in_gripper = diversity.axes.col(0);
  Eigen::Vector3d in_base = Eigen::Vector3d::Zero();
  for (const Eigen::Isometry3d& T : T_base_gripper) in_base += T.linear() * in_gripper;
  in_base.normalize();
  const Eigen::Vector3d gripper_upright = upright(in_gripper), base_upright = upright(in_base);
  OneAxis axis;
  const bool in_hand = setup == Setup::eye_in_hand;
  axis.camera = in_hand ? gripper_upright : base_upright;
  axis.target = in_hand ? base_upright : gripper_upright;
  axis.sense = gripper_upright.dot(in_gripper) * base_upright.dot(in_base) > 0 ? 1 : -1;
  axis.across2 = diversity.spread.tail<2>().squaredNorm();
  return axis;
}

Vector6d untold_direction(const OneAxis& axis, const Eigen::Isometry3d& X) {
  Vector6d direction = Vector6d::Zero();
  direction.head<3>() = X.linear().transpose() * axis.camera;
  return direction;
}

}  // namespace flash::calib
