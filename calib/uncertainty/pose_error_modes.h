#pragma once
#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "calib/solve/bundle.h"

namespace flash::calib {

/// The ways in which an error moves the gripper, as columns of (dt, dtheta) in base axes.
struct PoseModes {
  static constexpr int kOwn = 6, kSmooth = 5;
  using Columns = Eigen::Matrix<double, kOwn, 3>;
  Eigen::Vector3d place;
  Eigen::Matrix3d attitude;
  Columns translation, rotation;  ///< of independent errors, about the arm's pivot
  std::array<Columns, kSmooth>
      smooth;  ///< of a turn by one radian, and of lengths that are wrong in proportion
};

/// Of one pose. pivot: of its arm, in the gripper's frame; middle: of the places of all [m].
PoseModes modes_at(const Eigen::Isometry3d& T_base_gripper, const Eigen::Vector3d& pivot,
                   const Eigen::Vector3d& middle);

/// Of some poses of a bundle.
std::vector<PoseModes> modes_of(const Bundle& bundle, const std::vector<std::size_t>& poses);

/// Squared distances of poses [rad]: of attitudes (chordal, so that a kernel is positive) and of places over
/// the arm's reach. Joints turn by that between them, however far apart a recording's poses are.
Eigen::MatrixXd squared_distances(const std::vector<PoseModes>& modes);

/// Matern 5/2 of poses at those distances (Rasmussen and Williams 2006). reach [rad]
Eigen::MatrixXd matern(const Eigen::MatrixXd& squared, double reach);

}  // namespace flash::calib
