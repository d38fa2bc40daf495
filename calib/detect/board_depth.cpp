#include "calib/detect/board_depth.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "data/files/error.h"
#include "data/numbers/median.h"

namespace flash::calib {
namespace {

constexpr int kLeastPixels = 50, kMostPixels = 5000;
constexpr double kTrim = 4;  // flying pixels lie beyond that many robust standard deviations

/// A depth on its normalised ray (x, y, 1).
struct RayDepth {
  Eigen::Vector3d ray;
  double z = 0;
};

std::vector<cv::Point2f> hull_of(const Eigen::Matrix2Xd& corners) {
  std::vector<cv::Point2f> seen, hull;
  for (Eigen::Index i = 0; i < corners.cols(); ++i)
    seen.emplace_back(static_cast<float>(corners(0, i)), static_cast<float>(corners(1, i)));
  cv::convexHull(seen, hull);
  return hull;
}

/// Where a row crosses the outline.
std::pair<double, double> span_of(const std::vector<cv::Point2f>& hull, int y) {
  double first = std::numeric_limits<double>::infinity(), last = -first;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const cv::Point2f a = hull[i], b = hull[(i + 1) % hull.size()];
    if (y < std::min(a.y, b.y) || y > std::max(a.y, b.y)) continue;
    // A level edge is a crossing at either end; its other end is the next edge's.
    const double x = a.y == b.y ? a.x : a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x);
    first = std::min(first, x);
    last = std::max(last, x);
  }
  return {first, last};
}

/// 1 / z = plane . ray. Gauss and Newton from `plane`, on the depths.
void fit(const std::vector<RayDepth>& depths, Eigen::Vector3d& plane) {
  for (int iteration = 0; iteration < 4; ++iteration) {
    Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    for (const RayDepth& d : depths) {
      const double z = 1 / plane.dot(d.ray);
      const Eigen::Vector3d J = -z * z * d.ray;
      H += J * J.transpose();
      g += J * (d.z - z);
    }
    plane += H.ldlt().solve(g);
  }
}

/// Inverse depths are linear in the rays: where to start.
Eigen::Vector3d seed(const std::vector<RayDepth>& depths) {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  for (const RayDepth& d : depths) {
    const double weight = std::pow(d.z, 4);
    H += weight * d.ray * d.ray.transpose();
    g += weight / d.z * d.ray;
  }
  return H.ldlt().solve(g);
}

/// Three rays on which the depths of the fitted plane are uncorrelated. With J = -z^2 (1, x, y) the
/// covariance of two of them is z_i^2 z_j^2 (1 + u_i . u_j) / sum(z^4), u being the place whitened by the
/// moments of the rays weighted with z^4: zero for an equilateral triangle at |u| = sqrt(2).
Eigen::Matrix3d independent_rays(const std::vector<RayDepth>& depths, const Eigen::Vector3d& plane) {
  double sum = 0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d square = Eigen::Matrix2d::Zero();
  for (const RayDepth& d : depths) {
    const double weight = std::pow(plane.dot(d.ray), -4);
    sum += weight;
    mean += weight * d.ray.head<2>();
    square += weight * d.ray.head<2>() * d.ray.head<2>().transpose();
  }
  mean /= sum;
  const Eigen::Matrix2d root = (square / sum - mean * mean.transpose()).llt().matrixL();
  Eigen::Matrix3d rays;
  for (int k = 0; k < 3; ++k) {
    const double angle = 2 * M_PI * k / 3;
    rays.col(k) =
        (mean + root * (std::sqrt(2.0) * Eigen::Vector2d(std::cos(angle), std::sin(angle)))).homogeneous();
  }
  return rays;
}

}  // namespace

std::vector<Eigen::Vector2i> pixels_within(const Eigen::Matrix2Xd& corners, int width, int height) {
  std::vector<Eigen::Vector2i> pixels;
  if (corners.cols() < 3) return pixels;
  const std::vector<cv::Point2f> hull = hull_of(corners);
  const cv::Rect box = cv::boundingRect(hull) & cv::Rect(0, 0, width, height);
  for (int y = box.y; y < box.y + box.height; ++y) {
    const auto [first, last] = span_of(hull, y);
    if (!(first <= last)) continue;
    const int end = std::min(width - 1, static_cast<int>(std::floor(last)));
    for (int x = std::max(0, static_cast<int>(std::ceil(first))); x <= end; ++x) pixels.emplace_back(x, y);
  }
  return pixels;
}

void expect_registered(const data::DepthMap& depth, const data::CameraIntrinsics& camera,
                       const std::string& image) {
  const auto size = [](int width, int height) {
    return std::to_string(width) + " x " + std::to_string(height);
  };
  if (depth.width != camera.width || depth.height != camera.height)
    throw data::InputError(image + ": its depth picture is " + size(depth.width, depth.height) +
                           ", the camera " + size(camera.width, camera.height) +
                           " (depth must be registered to it)");
}

BoardDepth board_depth(const data::DepthMap& depth, const data::CameraIntrinsics& camera,
                       const Observation& view) {
  expect_registered(depth, camera, view.image);
  BoardDepth result;
  std::vector<Eigen::Vector2i> pixels = pixels_within(view.pixels, depth.width, depth.height);
  std::erase_if(pixels, [&](const Eigen::Vector2i& pixel) { return depth.at(pixel.x(), pixel.y()) == 0; });
  if (static_cast<int>(pixels.size()) < kLeastPixels) return result;
  std::vector<RayDepth> depths;
  const double step = std::max(1.0, static_cast<double>(pixels.size()) / kMostPixels);
  for (double i = 0; i < static_cast<double>(pixels.size()); i += step) {
    const Eigen::Vector2i& pixel = pixels[static_cast<std::size_t>(i)];
    depths.push_back({data::unproject(camera, pixel.cast<double>(), 1), depth.at(pixel.x(), pixel.y())});
  }

  Eigen::Vector3d plane = seed(depths);
  for (int round = 0; round < 4; ++round) {
    std::vector<double> off;
    for (const RayDepth& d : depths) off.push_back(std::abs(d.z - 1 / plane.dot(d.ray)));
    const double limit = kTrim * 1.4826 * data::median(off) + 1e-9;
    std::erase_if(depths, [&](const RayDepth& d) { return std::abs(d.z - 1 / plane.dot(d.ray)) > limit; });
    if (static_cast<int>(depths.size()) < kLeastPixels) return result;
    fit(depths, plane);
  }
  const Eigen::Matrix3d rays = independent_rays(depths, plane);
  if (!rays.allFinite() || !((plane.transpose() * rays).minCoeff() > 0)) return result;
  double squares = 0;
  for (const RayDepth& d : depths) squares += std::pow(d.z - 1 / plane.dot(d.ray), 2);
  result.noise = std::sqrt(squares / (static_cast<double>(depths.size()) - 3));
  result.pixels = static_cast<int>(depths.size());
  result.points.resize(3, 3);
  for (int k = 0; k < 3; ++k) result.points.col(k) = rays.col(k) / plane.dot(rays.col(k));
  return result;
}

double depth_over_pose(const Eigen::Matrix3Xd& points, const Eigen::Isometry3d& T_camera_target) {
  const Eigen::Vector3d normal = T_camera_target.linear().col(2);
  const double height = normal.dot(T_camera_target.translation());
  double sum = 0;
  for (Eigen::Index i = 0; i < points.cols(); ++i) sum += normal.dot(points.col(i)) / height;
  return sum / static_cast<double>(points.cols());
}

}  // namespace flash::calib
