#include "calib/solve/correction_error.h"

namespace flash::calib {

CorrectionError correction_error(const Eigen::Isometry3d& D, const Eigen::Isometry3d& E,
                                 const Eigen::Vector3d& p,
                                 const Eigen::Matrix<double, 6, Eigen::Dynamic>& J) {
  const Eigen::Matrix3d between = E.linear().transpose() * D.linear();
  const Eigen::Vector3d angle = rotation_log(between);
  const Eigen::Matrix3d inverse = right_jacobian_inverse(angle);
  CorrectionError error;
  error.value << D * p - E * p, angle;
  error.by_correction.setZero();
  error.by_correction.topLeftCorner<3, 3>() = D.linear();
  error.by_correction.topRightCorner<3, 3>() = -D.linear() * skew(p);
  error.by_correction.bottomRightCorner<3, 3>() = inverse;
  error.by_errors.resize(6, J.cols());
  if (J.cols() == 0) return error;
  error.by_errors.topRows<3>() = -J.topRows<3>() + E.linear() * skew(p) * J.bottomRows<3>();
  error.by_errors.bottomRows<3>() = -inverse * between.transpose() * J.bottomRows<3>();
  return error;
}

}  // namespace flash::calib
