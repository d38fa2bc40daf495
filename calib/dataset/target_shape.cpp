#include "calib/dataset/target_shape.h"

#include <cmath>

#include "calib/dataset/told_shape.h"

namespace flash::calib {
namespace {

double longer_side(const Eigen::Matrix3Xd& target_points) {
  return (target_points.rowwise().maxCoeff() - target_points.rowwise().minCoeff()).maxCoeff();
}

}  // namespace

Bows target_bows(const Eigen::Matrix3Xd& target_points) {
  const Eigen::Array3d low = target_points.rowwise().minCoeff(), high = target_points.rowwise().maxCoeff();
  const Eigen::Array2d middle = 0.5 * (low + high).head<2>();
  const Eigen::Array2d half = (0.5 * (high - low).head<2>()).max(1e-9);
  const Eigen::Array2Xd place = (target_points.topRows<2>().array().colwise() - middle).colwise() / half;
  Bows bows(kWarp, target_points.cols());
  bows.topRows<2>() = 1 - place.square();
  bows.row(2) = place.row(0) * place.row(1);
  return bows;
}

double usual_size_sd(const Eigen::Matrix3Xd& target_points) {
  const double ruler = 1e-3 / std::sqrt(12.0);  // [m], of what is rounded to a millimetre
  return std::hypot(kPrintSd, ruler / longer_side(target_points));
}

double usual_warp_sd(const Eigen::Matrix3Xd& target_points) {
  constexpr double kShare = 0.003;  // paper on a board; glass and metal are flatter by far
  return kShare * longer_side(target_points);
}

Eigen::Matrix3Xd shaped(Eigen::Matrix3Xd points, const Bows& bows, const TargetShape& shape) {
  points.row(2) += shape.warp.transpose() * bows;
  return shape.scale * points;
}

bool WarpEstimate::far_off() const {
  constexpr double kFar = 3;  // standard deviations
  return prior_sd > 0 &&
         (estimate.array().abs() > kFar * (sd.array().square() + prior_sd * prior_sd).sqrt()).any();
}

std::string warp_sentence(const WarpEstimate& warp) {
  return "the target is not flat: " + describe(warp, 2) +
         " (2 sd); the answer takes it into account, a flat target needs no such guess";
}

}  // namespace flash::calib
