#include "calib/detect/lens_doubt.h"

#include <cmath>
#include <cstdio>

#include "calib/detect/plane_residual.h"
#include "data/camera/posed_lens.h"
#include "data/numbers/median.h"

namespace flash::calib {
namespace {

/// Of the corners about their middle, rms [px].
double extent(const Eigen::Matrix2Xd& pixels) {
  return std::sqrt((pixels.colwise() - pixels.rowwise().mean()).squaredNorm() /
                   static_cast<double>(pixels.cols()));
}

}  // namespace

std::string lens_doubt(const Dataset& dataset, const Target& target,
                       const std::vector<Detection>& detections) {
  // A pose that is off by a degree bends the corners by as much of their extent: turns then no longer close.
  constexpr double kDegree = M_PI / 180;
  // Of two numbers that a homography has more than a pose, over one of what it leaves: by chance a pose loses
  // as much once in a thousand views of twenty corners.
  constexpr double kChance = 9;
  if (!dataset.camera) return {};
  const Eigen::Matrix3Xd points = target_points(target);
  std::vector<double> by_pose, by_plane, shares, gains;
  for (const Detection& detection : detections) {
    if (detection.readings.empty()) continue;
    const Observation& view = detection.readings.front().observation;
    const double plane = plane_residual(points, view);
    if (!(plane > 0)) continue;
    const double corners = static_cast<double>(view.points.size());
    const double pose_squares = corners * view.pose_rms * view.pose_rms,
                 plane_squares = (corners - 4) * plane * plane;
    by_pose.push_back(view.pose_rms);
    by_plane.push_back(plane);
    shares.push_back(view.pose_rms / extent(view.pixels));
    gains.push_back((pose_squares - plane_squares) / 2 / (plane * plane / 2));
  }
  if (by_pose.empty() || data::median(shares) < kDegree || data::median(gains) < kChance) return {};
  char text[240];
  std::snprintf(
      text, sizeof text,
      ": the corners of the usual view lie %.2f px from where any pose puts them through this lens, "
      "and %.2f px from a flat target seen through another: correct the lens, or calibrate it "
      "(flash-calib intrinsics)",
      data::median(by_pose), data::median(by_plane));
  return dataset.camera_path + ": the lens " + data::describe_lens(*dataset.camera) +
         " does not fit the pictures" + text;
}

}  // namespace flash::calib
