#include "calib/dataset/target_shape.h"

namespace flash::calib {

Eigen::Matrix2Xd target_bows(const Eigen::Matrix3Xd& target_points) {
  const Eigen::Array3d low = target_points.rowwise().minCoeff(), high = target_points.rowwise().maxCoeff();
  const Eigen::Array2d middle = 0.5 * (low + high).head<2>();
  const Eigen::Array2d half = (0.5 * (high - low).head<2>()).max(1e-9);
  return 1 - ((target_points.topRows<2>().array().colwise() - middle).colwise() / half).square();
}

double usual_warp_sd(const Eigen::Matrix3Xd& target_points) {
  constexpr double kShare = 0.003;  // paper on a board; glass and metal are flatter by far
  return kShare * (target_points.rowwise().maxCoeff() - target_points.rowwise().minCoeff()).maxCoeff();
}

Eigen::Matrix3Xd shaped(Eigen::Matrix3Xd points, const Eigen::Matrix2Xd& bows, const TargetShape& shape) {
  points.row(2) += shape.warp.transpose() * bows;
  return shape.scale * points;
}

}  // namespace flash::calib
