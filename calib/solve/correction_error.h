#pragma once
#include "calib/geometry/pose.h"

namespace flash::calib {

/// How far the correction D of a robot pose is from the usual one E, which the errors of joints make:
///     dt = D p - E p at the pivot p,  dtheta = log(E^T D).
struct CorrectionError {
  Vector6d value;          ///< (dt, dtheta)
  Matrix6d by_correction;  ///< right perturbation of D
  Eigen::Matrix<double, 6, Eigen::Dynamic> by_errors =
      {};  ///< E = moved(I, J errors), to first order of them
};
CorrectionError correction_error(const Eigen::Isometry3d& D, const Eigen::Isometry3d& E,
                                 const Eigen::Vector3d& p, const Eigen::Matrix<double, 6, Eigen::Dynamic>& J);

}  // namespace flash::calib
