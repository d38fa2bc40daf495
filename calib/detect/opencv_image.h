#pragma once
#include <Eigen/Geometry>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "calib/detect/grey_image.h"

namespace flash::calib {

/// The same pixels, seen by OpenCV, which does not write to them.
inline cv::Mat as_mat(const GreyImage& image) {
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels.data())};
}

inline std::vector<Eigen::Vector2d> to_eigen(const std::vector<cv::Point2f>& points) {
  std::vector<Eigen::Vector2d> result;
  for (const cv::Point2f& point : points) result.emplace_back(point.x, point.y);
  return result;
}

inline std::vector<cv::Point2f> to_opencv(const std::vector<Eigen::Vector2d>& points) {
  std::vector<cv::Point2f> result;
  for (const Eigen::Vector2d& point : points)
    result.emplace_back(static_cast<float>(point.x()), static_cast<float>(point.y()));
  return result;
}

/// OpenCV's own corner refiner; half_window [px].
inline std::vector<Eigen::Vector2d> corner_sub_pix(const GreyImage& image,
                                                   const std::vector<Eigen::Vector2d>& corners,
                                                   int half_window) {
  std::vector<cv::Point2f> points = to_opencv(corners);
  cv::cornerSubPix(as_mat(image), points, {half_window, half_window}, {-1, -1},
                   {cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 60, 1e-3});
  return to_eigen(points);
}

/// A homography from the plane to pixels by least squares, or the most that agree within `tolerance` [px];
/// zero where there is none.
inline Eigen::Matrix3d homography(const std::vector<Eigen::Vector2d>& plane,
                                  const std::vector<Eigen::Vector2d>& pixels, double tolerance = 0) {
  std::vector<cv::Point2d> from, to;
  for (std::size_t i = 0; i < plane.size(); ++i) {
    from.emplace_back(plane[i].x(), plane[i].y());
    to.emplace_back(pixels[i].x(), pixels[i].y());
  }
  if (from.size() < 4) return Eigen::Matrix3d::Zero();
  const cv::Mat found =
      cv::findHomography(from, to, tolerance > 0 ? cv::RANSAC : 0, tolerance > 0 ? tolerance : 3);
  if (found.empty()) return Eigen::Matrix3d::Zero();
  return Eigen::Matrix<double, 3, 3, Eigen::RowMajor>(found.ptr<double>());
}

inline Eigen::Vector2d apply(const Eigen::Matrix3d& H, const Eigen::Vector2d& point) {
  return (H * point.homogeneous()).hnormalized();
}

}  // namespace flash::calib
