#include "sysid/capture/lying_sheet.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace flash::sysid {
namespace {

/// The right edge along x, the left one along y.
Eigen::Rotation2Dd to_edges(const LyingSheet& sheet) {
  return Eigen::Rotation2Dd(std::atan2(sheet.left, sheet.right) - sheet.heading);
}

double outside_of(const Eigen::Vector2d& size, const Eigen::Vector2d& local) {
  return (local - local.cwiseMax(0.0).cwiseMin(size)).norm();
}

}  // namespace

double distance_beside(const LyingSheet& sheet, const Eigen::Vector2d& point) {
  return outside_of({sheet.right, sheet.left}, to_edges(sheet) * (point - sheet.corner));
}

double distance_to(const LyingSheet& sheet, const std::vector<Eigen::Vector2d>& points) {
  if (points.empty()) return std::numeric_limits<double>::infinity();
  const Eigen::Rotation2Dd turn = to_edges(sheet);
  const Eigen::Vector2d size(sheet.right, sheet.left);
  std::vector<Eigen::Vector2d> local;
  double outside = 0;
  for (const Eigen::Vector2d& point : points) {
    local.push_back(turn * (point - sheet.corner));
    outside += outside_of(size, local.back());
  }
  constexpr int samples = 16;  // a side
  double unseen = 0;
  for (int i = 0; i < samples; ++i)
    for (int j = 0; j < samples; ++j) {
      const Eigen::Vector2d place = size.cwiseProduct(Eigen::Vector2d(i, j)) / (samples - 1);
      double nearest = std::numeric_limits<double>::infinity();
      for (const Eigen::Vector2d& point : local) nearest = std::min(nearest, (point - place).squaredNorm());
      unseen += std::sqrt(nearest);
    }
  return outside / static_cast<double>(points.size()) + unseen / (samples * samples);
}

LyingSheet turned_to(LyingSheet sheet, const std::vector<Eigen::Vector2d>& points) {
  const double middle = sheet.heading;
  double least = std::numeric_limits<double>::infinity();
  for (int degrees = -25; degrees <= 25; ++degrees) {
    LyingSheet turned = sheet;
    turned.heading = middle + degrees * std::numbers::pi / 180;
    const double distance = distance_to(turned, points);
    if (distance < least) {
      least = distance;
      sheet.heading = turned.heading;
    }
  }
  return sheet;
}

}  // namespace flash::sysid
