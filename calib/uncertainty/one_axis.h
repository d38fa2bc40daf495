#pragma once
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "calib/geometry/pose.h"
#include "calib/geometry/setup.h"

namespace flash::calib {

/// The axis that nearly all turns of a robot are about, as those of a four-axis arm. In A X = X B the camera
/// may then move along it, and the target with it, without a change in any view.
struct OneAxis {
  Eigen::Vector3d camera = Eigen::Vector3d::UnitZ();  ///< in the frame in which X is written, unit
  Eigen::Vector3d target = Eigen::Vector3d::UnitZ();  ///< in that of Z; largest part positive in both
  double sense = 1;    ///< the camera by d along its axis, the target by sense d along its: nothing changes
  double across2 = 0;  ///< mean square of turns about the other two axes, between two views [rad^2]

  /// Of those turns the part that robot poses with so much noise an axis [rad] report of themselves.
  double noise_share(double rotation) const;
};

/// None where turns about a second axis are wide: beyond 10 deg rms, or a quarter of those about the first.
std::optional<OneAxis> one_axis(Setup setup, const std::vector<Eigen::Isometry3d>& T_base_gripper);

/// The direction in which X is not told, a right perturbation (dt, dtheta) of unit length.
Vector6d untold_direction(const OneAxis& axis, const Eigen::Isometry3d& X);

}  // namespace flash::calib
