#pragma once
#include <Eigen/Geometry>

#include "calib/geometry/pose.h"

namespace flash::calib {

/// What is known beforehand of where the camera, or the target, is along a line: axis . t = place +- sd.
/// Turns about that line alone do not tell it.
struct AlongPrior {
  bool target = false;                              ///< of the target, Z; else of the camera, X
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< unit, in the frame in which t is written
  double place = 0;                                 ///< [m]
  double sd = 1;                                    ///< [m]
};

/// (axis . t - place) / sd, and its derivative by a right perturbation (dt, dtheta) of T.
struct AlongResidual {
  double value = 0;
  Eigen::Matrix<double, 1, 6> by_pose = Eigen::Matrix<double, 1, 6>::Zero();
};
inline AlongResidual along_residual(const AlongPrior& prior, const Eigen::Isometry3d& T) {
  AlongResidual residual{.value = (prior.axis.dot(T.translation()) - prior.place) / prior.sd};
  residual.by_pose.head<3>() = prior.axis.transpose() * T.linear() / prior.sd;
  return residual;
}

}  // namespace flash::calib
