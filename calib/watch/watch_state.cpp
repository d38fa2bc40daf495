#include "calib/watch/watch_state.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/geometry/projection.h"
#include "calib/uncertainty/observability.h"

namespace flash::calib {
namespace {

constexpr double kDegrees = 180 / M_PI;
constexpr double kWideTurn = 10;  // rms about the second axis, from which on the answer is no poorer for it

template <class... Values>
std::string formatted(const char* format, const Values&... values) {
  char text[320];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

bool shows_target(const WatchedPicture& picture) {
  return picture.looked_at && !picture.detection.readings.empty();
}

LastPicture last_picture(const WatchedPicture& picture, const Eigen::Matrix3Xd& points) {
  LastPicture last{.name = picture.name,
                   .looked_at = picture.looked_at,
                   .has_pose = picture.T_base_gripper.has_value(),
                   .found = 0,
                   .expected = static_cast<int>(points.cols()),
                   .reason = picture.detection.reason,
                   .corners = {}};
  if (!shows_target(picture)) return last;
  last.corners = picture.detection.readings.front().observation.pixels;
  last.found = static_cast<int>(last.corners.cols());
  return last;
}

ImageCoverage image_coverage(const WatchInputs& inputs) {
  ImageCoverage coverage;
  if (!inputs.camera || inputs.camera->width <= 0) return coverage;
  const Eigen::Array2d cell(static_cast<double>(inputs.camera->width) / ImageCoverage::kColumns,
                            static_cast<double>(inputs.camera->height) / ImageCoverage::kRows);
  for (const WatchedPicture& picture : inputs.pictures) {
    if (!shows_target(picture)) continue;
    for (const auto& pixel : picture.detection.readings.front().observation.pixels.colwise()) {
      const Eigen::Array2i place = ((pixel.array() + 0.5) / cell).floor().cast<int>();
      ++coverage.counts(std::clamp(place.y(), 0, ImageCoverage::kRows - 1),
                        std::clamp(place.x(), 0, ImageCoverage::kColumns - 1));
    }
  }
  coverage.share = static_cast<double>((coverage.counts.array() > 0).count()) / coverage.counts.size();
  return coverage;
}

std::string axis_text(const Eigen::Vector3d& axis) {
  Eigen::Index largest = 0;
  axis.cwiseAbs().maxCoeff(&largest);
  const Eigen::Vector3d r =
      (100 * (axis[largest] < 0 ? -axis : axis)).array().round() / 100 + 0.0;  // no minus zero
  return formatted("(%.2f, %.2f, %.2f) of the gripper", r.x(), r.y(), r.z());
}

std::vector<Eigen::Isometry3d> poses_of_views(const WatchInputs& inputs) {
  std::vector<Eigen::Isometry3d> poses;
  for (const WatchedPicture& picture : inputs.pictures)
    if (shows_target(picture) && picture.T_base_gripper) poses.push_back(*picture.T_base_gripper);
  return poses;
}

Eigen::Vector3d turn_from(const Eigen::Isometry3d& mean, const Eigen::Isometry3d& pose) {
  return kDegrees * rotation_log(mean.linear().transpose() * pose.linear());
}

TurnCoverage turn_coverage(const std::vector<Eigen::Isometry3d>& poses) {
  TurnCoverage turns;
  if (poses.empty()) return turns;
  const Eigen::Isometry3d mean = mean_pose(poses);
  for (const Eigen::Isometry3d& pose : poses) turns.turns_deg.push_back(turn_from(mean, pose));
  if (poses.size() < 2) return turns;
  const RotationDiversity diversity = rotation_diversity(poses);
  turns.spread_deg = kDegrees * diversity.spread;
  turns.axes = diversity.axes;
  if (turns.spread_deg.y() < kWideTurn)
    turns.sentence = formatted("turn more about %s: so far by %.0f deg rms",
                               axis_text(diversity.axes.col(1)).c_str(), turns.spread_deg.y());
  else
    turns.sentence = "turns about two axes are covered";
  return turns;
}

std::string least_known(const WatchInputs& inputs, const TurnCoverage& turns) {
  if (inputs.answer && inputs.answer->calibration) {
    const WeakestDirection& weakest = inputs.answer->calibration->weakest;
    return formatted("%s: %.2f mm, %.3f deg", weakest.name.c_str(), 1e3 * weakest.translation,
                     kDegrees * weakest.rotation);
  }
  if (turns.turns_deg.size() < 2) return {};
  return formatted("turns about %s: %.0f deg rms so far", axis_text(turns.axes.col(2)).c_str(),
                   turns.spread_deg.z());
}

std::string advice(const WatchInputs& inputs, const TurnCoverage& turns) {
  if (inputs.pictures.empty())
    return "Take the first picture: the whole target in view, a third to a half of the picture wide.";
  if (turns.turns_deg.empty())
    return "Bring the whole target into view, and have the robot's pose recorded with each picture.";
  if (turns.turns_deg.size() < 2)
    return "Tilt the gripper by 20 to 40 deg, and keep the whole target in view.";
  const Eigen::Index axis = turns.spread_deg.y() < kWideTurn ? 1 : 2;
  return "Turn the gripper by 20 to 40 deg about " + axis_text(turns.axes.col(axis)) +
         ", and keep the whole target in view.";
}

/// "120 mm along x, -40 mm along z of the base; turn by 25 deg about (0.10, 0.98, 0.17) of the gripper".
std::string move_text(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to) {
  constexpr double kLeast = 0.5;  // [mm, deg]
  const Eigen::Vector3d mm = 1e3 * (to.translation() - from.translation());
  std::string text;
  for (int k = 0; k < 3; ++k)
    if (std::abs(mm[k]) >= kLeast)
      text += formatted("%s%+.0f mm along %c", text.empty() ? "" : ", ", mm[k], "xyz"[k]);
  text = text.empty() ? "stay where it is" : text + " of the base";
  const Eigen::Vector3d turn = turn_from(from, to);
  if (turn.norm() < kLeast) return text;
  const Eigen::Vector3d axis = turn.normalized();
  return text + formatted("; turn by %.0f deg about (%.2f, %.2f, %.2f) of the gripper", turn.norm(), axis.x(),
                          axis.y(), axis.z());
}

/// "target in the upper left of the picture, 0.42 m away, its left side 31 deg nearer".
std::string view_text(const Eigen::Isometry3d& T_camera_target, const Eigen::Vector2d& pixel,
                      const Eigen::Vector3d& middle, const data::CameraIntrinsics& camera) {
  const auto third = [](double place, int size) {
    return std::clamp(static_cast<int>(3 * place / size), 0, 2);
  };
  constexpr const char* kPlaces[3][3] = {{"upper left", "upper middle", "upper right"},
                                         {"middle left", "middle", "middle right"},
                                         {"lower left", "lower middle", "lower right"}};
  std::string text = formatted("target in the %s of the picture, %.2f m away",
                               kPlaces[third(pixel.y(), camera.height)][third(pixel.x(), camera.width)],
                               (T_camera_target * middle).norm());
  // Its plane comes nearer to where its normal, which points away from the camera, leans in the picture.
  const Eigen::Vector3d normal = T_camera_target.linear().col(2);
  const double tilt = kDegrees * std::acos(std::clamp(normal.z(), -1.0, 1.0));
  if (tilt < 5) return text + ", facing the camera";
  const bool across = std::abs(normal.x()) > std::abs(normal.y());
  const char* side = across ? (normal.x() > 0 ? "right" : "left") : (normal.y() > 0 ? "lower" : "upper");
  return text + formatted(", tilted by %.0f deg with its %s side nearer", tilt, side);
}

NextPose next_pose(const WatchInputs& inputs, const std::vector<Eigen::Isometry3d>& poses) {
  const WatchAnswer& answer = *inputs.answer;
  NextPose next;
  next.T_base_gripper = answer.next->T_base_gripper;
  next.translation_sd = answer.next->translation_sd;
  next.rotation_sd = answer.next->rotation_sd;
  if (!poses.empty()) {
    next.turn_deg = turn_from(mean_pose(poses), next.T_base_gripper);
    next.move = move_text(poses.back(), next.T_base_gripper);
  }
  const auto I = Eigen::Isometry3d::Identity();
  const HandEyePoses& found = answer.calibration->poses;
  const Eigen::Isometry3d T_camera_target =
      Chain(inputs.setup, found.X, I, next.T_base_gripper, I, found.Z).target_in_camera();
  const Eigen::Vector3d low = inputs.points.rowwise().minCoeff(), high = inputs.points.rowwise().maxCoeff(),
                        middle = (low + high) / 2;
  const IntrinsicsVector lens = to_vector(*inputs.camera);
  next.outline.resize(2, 4);
  const Eigen::Vector3d corners[] = {low, {high.x(), low.y(), 0}, high, {low.x(), high.y(), 0}};
  for (Eigen::Index i = 0; i < 4; ++i)
    next.outline.col(i) = project(lens, T_camera_target * corners[static_cast<std::size_t>(i)]);
  next.view = view_text(T_camera_target, project(lens, T_camera_target * middle), middle, *inputs.camera);
  return next;
}

}  // namespace

KnownAfter known_after(const WatchAnswer& answer) {
  KnownAfter known{.views = answer.views};
  if (!answer.calibration) return known;
  const Calibration& calibration = *answer.calibration;
  Matrix6d covariance = calibration.covariance;
  if (calibration.along && !calibration.along->told)
    covariance -= covariance_along(*calibration.along, calibration.poses.X);
  known.translation_sd = std::sqrt(covariance.topLeftCorner<3, 3>().trace() / 3);
  known.rotation_sd = std::sqrt(covariance.bottomRightCorner<3, 3>().trace() / 3);
  return known;
}

WatchState watch_state(const WatchInputs& inputs) {
  WatchState state;
  state.parent = inputs.setup == Setup::eye_in_hand ? "gripper" : "base";
  if (inputs.camera) {
    state.width = inputs.camera->width;
    state.height = inputs.camera->height;
  }
  state.pictures = inputs.pictures.size();
  for (const WatchedPicture& picture : inputs.pictures) {
    state.looking += picture.looked_at ? 0 : 1;
    state.with_target += shows_target(picture) ? 1 : 0;
    state.with_pose += picture.T_base_gripper ? 1 : 0;
    if (picture.name == inputs.last) state.last = last_picture(picture, inputs.points);
  }
  const std::vector<Eigen::Isometry3d> poses = poses_of_views(inputs);
  state.image = image_coverage(inputs);
  state.turns = turn_coverage(poses);
  state.weakest = least_known(inputs, state.turns);
  if (inputs.answer && inputs.answer->next && inputs.camera) state.next = next_pose(inputs, poses);
  if (!state.next) state.advice = advice(inputs, state.turns);
  state.solving = inputs.solving;
  state.answer = inputs.answer;
  state.history = inputs.history;
  state.waiting = inputs.waiting;
  state.notes = inputs.notes;
  return state;
}

}  // namespace flash::calib
