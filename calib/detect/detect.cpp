#include "calib/detect/detect.h"

#include <algorithm>
#include <map>
#include <optional>
#include <tuple>

#include "calib/dataset/edge_offset.h"
#include "calib/detect/find_in_all.h"
#include "calib/detect/finder.h"
#include "calib/detect/planar_pose.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "data/machine/parallel.h"
#include "data/numbers/median.h"

namespace flash::calib {
namespace {

constexpr double kAlwaysGood = 2;  // small markers, seen aslant, vary by that much [px]

Observation observe(const Frame& frame, const Target& target, const Sighting& sighting) {
  Observation observation;
  observation.image = frame.name;
  observation.T_base_gripper = frame.T_base_gripper;
  observation.joint_motions = frame.joint_motions;
  observation.joint_sd = frame.joint_sd;
  observation.points = sighting.points;
  observation.pixels.resize(2, static_cast<Eigen::Index>(sighting.pixels.size()));
  for (std::size_t i = 0; i < sighting.pixels.size(); ++i)
    observation.pixels.col(static_cast<Eigen::Index>(i)) = sighting.pixels[i];
  observation.outward = outward_motion(target.kind, observation.pixels);
  return observation;
}

Eigen::Matrix3Xd chosen(const Eigen::Matrix3Xd& points, const std::vector<int>& ids) {
  Eigen::Matrix3Xd result(3, static_cast<Eigen::Index>(ids.size()));
  for (std::size_t i = 0; i < ids.size(); ++i) result.col(static_cast<Eigen::Index>(i)) = points.col(ids[i]);
  return result;
}

/// The poses of each reading; drops those that no pose fits.
void add_poses(const data::CameraIntrinsics& camera, const Eigen::Matrix3Xd& points, double largest_rms,
               Detection& detection) {
  double least = 1e300;
  for (CornerReading& reading : detection.readings) {
    Observation& observation = reading.observation;
    for (const PlanarPose& pose :
         planar_poses(camera, chosen(points, observation.points), observation.pixels)) {
      if (observation.T_camera_target.empty()) observation.pose_rms = pose.rms;
      observation.T_camera_target.push_back(pose.T_camera_target);
    }
    if (!observation.T_camera_target.empty()) least = std::min(least, observation.pose_rms);
  }
  std::erase_if(detection.readings, [&](const CornerReading& reading) {
    return reading.observation.T_camera_target.empty() || reading.observation.pose_rms > largest_rms;
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

/// What was found in a picture, with the poses that fit it where there are intrinsics.
Detection detection_of(const Frame& frame, const Found& found, const Dataset& dataset, const Target& target,
                       const Eigen::Matrix3Xd& points, const DetectSettings& settings) {
  Detection detection;
  detection.image = frame.name;
  detection.reason = found.reason;
  for (const Sighting& sighting : found.sightings)
    detection.readings.push_back({sighting.refiner, observe(frame, target, sighting)});
  if (dataset.camera && detection.reason.empty())
    add_poses(*dataset.camera, points, settings.largest_rms, detection);
  return detection;
}

}  // namespace

void drop_misfits(const DetectSettings& settings, std::vector<Detection>& detections) {
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

namespace {

/// Width and height of the first picture that can be read.
std::pair<int, int> picture_size(const Dataset& dataset) {
  std::string reason;
  for (const Frame& frame : dataset.frames) try {
      const GreyImage image = load_grey_image(frame.image);
      return {image.width, image.height};
    } catch (const data::InputError& error) {
      if (reason.empty()) reason = error.what();
    }
  throw data::InputError(reason.empty() ? dataset.source + ": found no pictures" : reason);
}

Rectifier make_rectifier(const Dataset& dataset) {
  if (dataset.camera) return Rectifier(*dataset.camera);
  const auto [width, height] = picture_size(dataset);
  return {width, height};
}

/// What most of the first pictures show instead of the target, in words; empty where they do not agree.
std::string shown_instead(const Dataset& dataset, const Target& target, const Rectifier& rectifier) {
  constexpr std::size_t kPictures = 4;
  const bool tags = target.kind == TargetKind::apriltag || target.kind == TargetKind::aprilgrid;
  if (!tags && target.kind != TargetKind::aruco && target.kind != TargetKind::aruco_grid &&
      target.kind != TargetKind::charuco)
    return {};
  std::map<std::string, std::size_t> votes;
  std::size_t asked = 0;
  for (std::size_t i = 0; i < std::min(kPictures, dataset.frames.size()); ++i) try {
      const GreyImage image = load_grey_image(dataset.frames[i].image);
      ++asked;
      const std::optional<Target> shown =
          tags ? shown_tags(image, target, rectifier) : shown_markers(image, target, rectifier);
      if (shown) ++votes[to_words(*shown)];
    } catch (const data::InputError&) {
      continue;  // a picture that cannot be read shows nothing
    }
  for (const auto& [words, count] : votes)
    if (2 * count > asked) return words;
  return {};
}

}  // namespace

void take_picture_size(Dataset& dataset) {
  if (!dataset.camera || dataset.camera->width > 0) return;
  std::tie(dataset.camera->width, dataset.camera->height) = picture_size(dataset);
  dataset.guesses.push_back(dataset.camera_path + ": does not say the size of its pictures; they are " +
                            size_text(dataset.camera->width, dataset.camera->height));
}

std::vector<Detection> detect(const Dataset& dataset, const Target& target, const DetectSettings& settings,
                              const std::function<void(int, int)>& progress) {
  const Rectifier rectifier = make_rectifier(dataset);
  const Eigen::Matrix3Xd points = target_points(target);
  const std::vector<Found> found = find_in_all(dataset, target, rectifier, settings, progress);
  std::vector<Detection> detections(found.size());
  data::for_each_in_parallel(found.size(), settings.threads, [&](std::size_t k) {
    detections[k] = detection_of(dataset.frames[k], found[k], dataset, target, points, settings);
  });

  drop_misfits(settings, detections);
  const bool none = std::all_of(detections.begin(), detections.end(),
                                [](const Detection& detection) { return detection.readings.empty(); });
  const std::string shown = none ? shown_instead(dataset, target, rectifier) : std::string();
  if (!shown.empty())
    throw data::InputError(dataset.source + ": the target is seen in none of " +
                           std::to_string(found.size()) + " pictures; but they show another: --target " +
                           shown);
  if (none)
    throw data::InputError(dataset.source + ": the target is seen in none of " +
                           std::to_string(found.size()) + " pictures" +
                           (found.empty() ? "" : "; " + detections[0].image + ": " + detections[0].reason));
  return detections;
}

Detection detect_one(const Frame& frame, const Dataset& dataset, const Target& target,
                     const DetectSettings& settings) {
  Dataset alone = dataset;
  alone.frames = {frame};
  try {
    const Rectifier rectifier = make_rectifier(alone);
    const Found found = find_in_all(alone, target, rectifier, settings, {}).front();
    Detection detection = detection_of(frame, found, alone, target, target_points(target), settings);
    const std::string shown =
        found.sightings.empty() ? shown_instead(alone, target, rectifier) : std::string();
    if (!shown.empty()) detection.reason = "shows another target: --target " + shown;
    return detection;
  } catch (const data::InputError& error) {
    return {.image = frame.name, .reason = error.what(), .readings = {}};
  }
}

}  // namespace flash::calib
