#include <cmath>
#include <iostream>

#include "calib/calibrate/calibrate_pairs.h"

using flash::calib::Observation;

namespace {

Eigen::Isometry3d pose(const Eigen::Vector3d& translation, const Eigen::Vector3d& turn) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  T.translation() = translation;
  return T;
}

}  // namespace

// A camera on a gripper, and a target that stands still, seen from twelve places without noise.
int main() {
  const Eigen::Isometry3d T_gripper_camera = pose({0.05, 0.02, 0.08}, {0.3, -0.2, 0.4});
  const Eigen::Isometry3d T_base_target = pose({0.6, 0.1, 0.3}, {1.2, -2.0, 0.5});
  std::vector<Observation> observations;
  for (int i = 0; i < 12; ++i) {
    const Eigen::Isometry3d T_camera_target =
        pose({0.1 * std::sin(i), 0.1 * std::cos(2 * i), 0.5 + 0.1 * std::sin(3 * i)},
             {0.5 * std::sin(1.3 * i), 0.5 * std::cos(1.7 * i), std::sin(2.1 * i)});
    Observation& view = observations.emplace_back();
    view.image = std::to_string(i);
    view.T_base_gripper = T_base_target * T_camera_target.inverse() * T_gripper_camera.inverse();
    view.T_camera_target = {T_camera_target};
  }
  const flash::calib::Calibration result =
      flash::calib::calibrate_pairs(flash::calib::Setup::eye_in_hand, observations);
  const double off = (result.poses.X.matrix() - T_gripper_camera.matrix()).norm();
  std::cout << "off by " << off << '\n';
  return result.usable && off < 1e-9 ? 0 : 1;  // rounding of 1e-16, over a few hundred operations
}
