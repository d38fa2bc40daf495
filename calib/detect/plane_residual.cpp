#include "calib/detect/plane_residual.h"

#include <cmath>

#include "calib/detect/opencv_image.h"

namespace flash::calib {

double plane_residual(const Eigen::Matrix3Xd& target_points, const Observation& observation) {
  const std::size_t count = observation.points.size();
  if (count <= 4) return 0;
  std::vector<Eigen::Vector2d> plane, pixels;
  for (std::size_t i = 0; i < count; ++i) {
    plane.emplace_back(target_points.col(observation.points[i]).head<2>());
    pixels.emplace_back(observation.pixels.col(static_cast<Eigen::Index>(i)));
  }
  const Eigen::Matrix3d H = homography(plane, pixels);
  double squares = 0;
  for (std::size_t i = 0; i < count; ++i) squares += (pixels[i] - apply(H, plane[i])).squaredNorm();
  return std::sqrt(squares / (static_cast<double>(count) - 4));  // eight of 2 n numbers are fitted
}

}  // namespace flash::calib
