#include "calib/calibrate_images.h"

namespace flash::calib {
namespace {

/// A view for each picture, without poses where the target was not found.
std::vector<Observation> views_of(const std::vector<Detection>& detections, const std::string& refiner) {
  const std::vector<Observation> found = observations_of(detections, refiner);
  std::vector<Observation> views;
  auto next = found.begin();
  for (const Detection& detection : detections) {
    Observation missing;
    missing.image = detection.image;
    views.push_back(detection.readings.empty() ? missing : *next++);
  }
  return views;
}

}  // namespace

std::vector<Symmetry> confusable_symmetries(const Target& target) {
  std::vector<Symmetry> all = grid_symmetries(target_points(target));
  if (target.kind != TargetKind::chessboard && target.kind != TargetKind::circle_grid) all.resize(1);
  return all;
}

ImageCalibration calibrate_images(Setup setup, const Dataset& dataset, const Target& target,
                                  const std::vector<Detection>& detections, CalibrateSettings settings) {
  constexpr double kTie = 1.05;
  for (const Frame& frame : dataset.frames)
    if (frame.angles) settings.angles.push_back(*frame.angles);
  if (settings.angles.size() != dataset.frames.size()) settings.angles.clear();
  const std::vector<RefinerScore> ranking = rank_refiners(detections);
  const auto calibrated = [&](const std::string& refiner) {
    return ImageCalibration{calibrate(setup, *dataset.camera, target_points(target),
                                      confusable_symmetries(target), views_of(detections, refiner), settings),
                            refiner};
  };
  ImageCalibration best = calibrated(ranking.front().refiner);
  for (std::size_t i = 1; i < ranking.size() && ranking[i].rms <= kTie * ranking.front().rms; ++i) {
    ImageCalibration other = calibrated(ranking[i].refiner);
    if (other.calibration.held_out.px < best.calibration.held_out.px) best = std::move(other);
  }
  for (std::size_t i = 0; i < detections.size(); ++i)
    if (!detections[i].reason.empty()) best.calibration.views[i].reason = detections[i].reason;
  return best;
}

CellMember cell_member(const std::string& arm, const std::string& camera, const Dataset& dataset,
                       const Target& target, const Calibration& calibration) {
  CellMember member{.arm = arm, .camera = camera, .setup = calibration.setup, .intrinsics = *dataset.camera};
  member.points = target_points(target);
  member.symmetries = confusable_symmetries(target);
  member.poses = calibration.poses;
  member.covariance = calibration.covariance;
  for (const int i : calibration.used) {
    const auto view = static_cast<std::size_t>(i);
    member.observations.push_back(calibration.repair.observations[view]);
    member.stamps.push_back(dataset.frames[view].stamp);
  }
  return member;
}

}  // namespace flash::calib
