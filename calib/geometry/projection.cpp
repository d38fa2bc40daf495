#include "calib/geometry/projection.h"

#include <algorithm>

namespace flash::calib {

IntrinsicsVector to_vector(const data::CameraIntrinsics& camera) {
  IntrinsicsVector v = IntrinsicsVector::Zero();
  v.head<4>() << camera.fx, camera.fy, camera.cx, camera.cy;
  const std::size_t count = std::min<std::size_t>(8, camera.distortion.size());
  for (std::size_t i = 0; i < count; ++i) v[4 + static_cast<Eigen::Index>(i)] = camera.distortion[i];
  return v;
}

data::CameraIntrinsics with_vector(const data::CameraIntrinsics& camera, const IntrinsicsVector& intrinsics) {
  data::CameraIntrinsics result = camera;
  result.fx = intrinsics[0];
  result.fy = intrinsics[1];
  result.cx = intrinsics[2];
  result.cy = intrinsics[3];
  const bool rational = !intrinsics.tail<3>().isZero(0);
  const bool distorted = !intrinsics.tail<8>().isZero(0);
  if (rational) result.model = data::DistortionModel::rational_polynomial;
  if (distorted && camera.model == data::DistortionModel::none && !rational)
    result.model = data::DistortionModel::plumb_bob;
  const int used = result.model == data::DistortionModel::none                  ? 0
                   : result.model == data::DistortionModel::rational_polynomial ? 8
                                                                                : 5;
  result.distortion.assign(intrinsics.data() + 4, intrinsics.data() + 4 + used);
  return result;
}

Eigen::Vector2d project(const IntrinsicsVector& c, const Eigen::Vector3d& point,
                        Eigen::Matrix<double, 2, 3>* d_point,
                        Eigen::Matrix<double, 2, kIntrinsics>* d_intrinsics) {
  const double inverse_depth = 1 / point.z();
  const double x = point.x() * inverse_depth, y = point.y() * inverse_depth;
  const double xx = x * x, yy = y * y, xy = x * y, r2 = xx + yy, r4 = r2 * r2, r6 = r4 * r2;
  const double k1 = c[4], k2 = c[5], p1 = c[6], p2 = c[7], k3 = c[8], k4 = c[9], k5 = c[10], k6 = c[11];
  const double upper = 1 + k1 * r2 + k2 * r4 + k3 * r6, lower = 1 + k4 * r2 + k5 * r4 + k6 * r6;
  const double radial = upper / lower;
  const Eigen::Vector2d distorted(x * radial + 2 * p1 * xy + p2 * (r2 + 2 * xx),
                                  y * radial + p1 * (r2 + 2 * yy) + 2 * p2 * xy);
  const Eigen::Vector2d focal = c.head<2>();
  if (d_point) {
    // d(radial) / d(r^2)
    const double slope = (k1 + 2 * k2 * r2 + 3 * k3 * r4 - radial * (k4 + 2 * k5 * r2 + 3 * k6 * r4)) / lower;
    Eigen::Matrix2d inner;
    inner << radial + 2 * xx * slope + 2 * p1 * y + 6 * p2 * x, 2 * xy * slope + 2 * p1 * x + 2 * p2 * y,
        2 * xy * slope + 2 * p1 * x + 2 * p2 * y, radial + 2 * yy * slope + 6 * p1 * y + 2 * p2 * x;
    Eigen::Matrix<double, 2, 3> perspective;
    perspective << inverse_depth, 0, -x * inverse_depth, 0, inverse_depth, -y * inverse_depth;
    *d_point = focal.asDiagonal() * inner * perspective;
  }
  if (d_intrinsics) {
    Eigen::Matrix<double, 2, kIntrinsics>& d = *d_intrinsics;
    d.setZero();
    d(0, 0) = distorted.x();
    d(1, 1) = distorted.y();
    d(0, 2) = d(1, 3) = 1;
    const Eigen::Vector2d direction(focal.x() * x, focal.y() * y);
    d.col(4) = direction * (r2 / lower);
    d.col(5) = direction * (r4 / lower);
    d.col(6) << focal.x() * 2 * xy, focal.y() * (r2 + 2 * yy);
    d.col(7) << focal.x() * (r2 + 2 * xx), focal.y() * 2 * xy;
    d.col(8) = direction * (r6 / lower);
    d.col(9) = direction * (-radial * r2 / lower);
    d.col(10) = direction * (-radial * r4 / lower);
    d.col(11) = direction * (-radial * r6 / lower);
  }
  return focal.cwiseProduct(distorted) + c.segment<2>(2);
}

}  // namespace flash::calib
