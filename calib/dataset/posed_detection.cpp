#include "calib/dataset/posed_detection.h"

#include <algorithm>

#include "calib/geometry/planar_pose.h"
#include "data/files/text.h"
#include "data/numbers/median.h"

namespace flash::calib {
namespace {

constexpr double kAlwaysGood = 2;  // small markers, seen aslant, vary by that much [px]

Eigen::Matrix3Xd chosen(const Eigen::Matrix3Xd& points, const std::vector<int>& ids) {
  Eigen::Matrix3Xd result(3, static_cast<Eigen::Index>(ids.size()));
  for (std::size_t i = 0; i < ids.size(); ++i) result.col(static_cast<Eigen::Index>(i)) = points.col(ids[i]);
  return result;
}

}  // namespace

void add_poses(const data::CameraIntrinsics& camera, const Eigen::Matrix3Xd& target_points,
               const FitSettings& settings, Detection& detection) {
  double least = 1e300;
  for (CornerReading& reading : detection.readings) {
    Observation& observation = reading.observation;
    for (const PlanarPose& pose :
         planar_poses(camera, chosen(target_points, observation.points), observation.pixels)) {
      if (observation.T_camera_target.empty()) observation.pose_rms = pose.rms;
      observation.T_camera_target.push_back(pose.T_camera_target);
    }
    if (!observation.T_camera_target.empty()) least = std::min(least, observation.pose_rms);
  }
  std::erase_if(detection.readings, [&](const CornerReading& reading) {
    return reading.observation.T_camera_target.empty() || reading.observation.pose_rms > settings.largest_rms;
  });
  std::stable_sort(detection.readings.begin(), detection.readings.end(),
                   [](const CornerReading& a, const CornerReading& b) {
                     return a.observation.pose_rms < b.observation.pose_rms;
                   });
  if (detection.readings.empty())
    detection.reason = least < 1e300
                           ? "the corners fit the target no better than " + data::format_short(least) + " px"
                           : "the corners fit no pose of the target";
}

void drop_misfits(const FitSettings& settings, std::vector<Detection>& detections) {
  std::vector<double> rms;
  for (const Detection& detection : detections)
    if (!detection.readings.empty()) rms.push_back(detection.readings.front().observation.pose_rms);
  if (rms.empty()) return;
  const double usual = data::median(rms);
  const double limit = std::max(kAlwaysGood, settings.largest_ratio * usual);
  for (Detection& detection : detections) {
    if (detection.readings.empty()) continue;
    const double found = detection.readings.front().observation.pose_rms;
    if (found > limit) {
      detection.readings.clear();
      detection.reason = "the corners fit the target to " + data::format_short(found) +
                         " px, the usual view to " + data::format_short(usual) + " px";
    }
    std::erase_if(detection.readings,
                  [&](const CornerReading& reading) { return reading.observation.pose_rms > limit; });
  }
}

}  // namespace flash::calib
