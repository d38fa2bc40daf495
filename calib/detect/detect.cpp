#include "calib/detect/detect.h"

#include <algorithm>
#include <map>
#include <optional>
#include <tuple>

#include "calib/dataset/edge_offset.h"
#include "calib/dataset/posed_detection.h"
#include "calib/detect/find_in_all.h"
#include "calib/detect/finder.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "data/machine/parallel.h"

namespace flash::calib {
namespace {

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

/// What was found in a picture, with the poses that fit it where there are intrinsics.
Detection detection_of(const Frame& frame, const Found& found, const Dataset& dataset, const Target& target,
                       const Eigen::Matrix3Xd& points, const DetectSettings& settings) {
  Detection detection;
  detection.image = frame.name;
  detection.reason = found.reason;
  for (const Sighting& sighting : found.sightings)
    detection.readings.push_back({sighting.refiner, observe(frame, target, sighting)});
  if (dataset.camera && detection.reason.empty()) add_poses(*dataset.camera, points, settings.fit, detection);
  return detection;
}

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

  drop_misfits(settings.fit, detections);
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
