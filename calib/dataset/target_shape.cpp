#include "calib/dataset/target_shape.h"

#include <cmath>
#include <cstdio>

namespace flash::calib {
namespace {

double longer_side(const Eigen::Matrix3Xd& target_points) {
  return (target_points.rowwise().maxCoeff() - target_points.rowwise().minCoeff()).maxCoeff();
}

}  // namespace

Eigen::Matrix3Xd target_bows(const Eigen::Matrix3Xd& target_points) {
  const Eigen::Array3d low = target_points.rowwise().minCoeff(), high = target_points.rowwise().maxCoeff();
  const Eigen::Array2d middle = 0.5 * (low + high).head<2>();
  const Eigen::Array2d half = (0.5 * (high - low).head<2>()).max(1e-9);
  const Eigen::Array2Xd uv = (target_points.topRows<2>().array().colwise() - middle).colwise() / half;
  Eigen::Matrix3Xd bows(3, target_points.cols());
  bows.topRows<2>() = 1 - uv.square();
  bows.row(2) = uv.row(0) * uv.row(1);
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

Eigen::Matrix3Xd shaped(Eigen::Matrix3Xd points, const Eigen::Matrix3Xd& bows, const TargetShape& shape) {
  points.row(2) += shape.warp.transpose() * bows;
  return shape.scale * points;
}

bool WarpEstimate::far_off() const {
  constexpr double kFar = 3;  // standard deviations
  return prior_sd > 0 &&
         (estimate.array().abs() > kFar * (sd.array().square() + prior_sd * prior_sd).sqrt()).any();
}

std::string describe(const WarpEstimate& warp) {
  const Eigen::Vector3d mm = 1e3 * warp.estimate, sd = 1e3 * warp.sd;
  char text[160];
  std::snprintf(text, sizeof text,
                "bent by %.3f +- %.3f and %.3f +- %.3f mm along x and y, twisted by %.3f +- %.3f mm", mm.x(),
                sd.x(), mm.y(), sd.y(), mm.z(), sd.z());
  return text;
}

std::string warp_sentence(const WarpEstimate& warp) {
  return "the target is not flat but " + describe(warp) +
         "; the answer takes it into account, a flat target needs no such guess";
}

}  // namespace flash::calib
