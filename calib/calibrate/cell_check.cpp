#include "calib/calibrate/cell_check.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/calibrate/plausibility.h"
#include "data/numbers/chi_square.h"

namespace flash::calib {
namespace {

constexpr double kDegree = M_PI / 180;

template <class... Values>
std::string formatted(const char* format, const Values&... values) {
  char text[400];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

std::string scatter(const std::vector<CellMember>& members, const NoiseLevels& noise, double more) {
  double own = 0, joint = 0;
  for (const CellMember& member : members) own = std::max(own, member.corner_px);
  for (const double sigma : noise.corner) joint = std::max(joint, sigma);
  if (!(own > 0) || joint <= more * own) return {};
  return formatted(
      "the recordings contradict each other: solved together their corners scatter by %.2f px, by "
      "themselves by no more than %.2f px",
      joint, own);
}

/// Where the joint solution has what the member calls X.
Eigen::Isometry3d joint_pose(const CellMember& member, const Cell& cell) {
  const auto named = [](const std::vector<CellFrame>& frames, const std::string& name) {
    return std::find_if(frames.begin(), frames.end(),
                        [&](const CellFrame& frame) { return frame.transform.child == name; });
  };
  const Eigen::Isometry3d& camera = named(cell.cameras, member.camera)->transform.T;
  const auto base = named(cell.bases, member.arm);  // the first is the world
  if (member.setup == Setup::eye_in_hand || base == cell.bases.end()) return camera;
  return base->transform.T.inverse() * camera;
}

std::string misplaced(const CellMember& member, const Cell& cell, double times) {
  if (member.covariance.isZero()) return {};
  const Vector6d away = motion_between(member.poses.X, joint_pose(member, cell));
  if (away.dot(member.covariance.ldlt().solve(away)) < times * times * data::chi_square_95_of_6) return {};
  const Vector6d sd = member.covariance.diagonal().cwiseSqrt();
  return formatted(
      "the recordings contradict each other: solved together %s of %s is %.1f mm and %.2f deg from where "
      "that recording alone has it, which states %.1f mm and %.2f deg",
      member.camera.c_str(), member.arm.c_str(), 1e3 * away.head<3>().norm(), away.tail<3>().norm() / kDegree,
      1e3 * sd.head<3>().norm(), sd.tail<3>().norm() / kDegree);
}

double distance_of(const CellMember& member) {
  double sum = 0;
  for (const Observation& view : member.observations)
    sum += view.T_camera_target.front().translation().norm();
  return sum / static_cast<double>(member.observations.size());
}

/// The covariance of a base where its arm has the camera: turns of a frame far away move its places.
Matrix6d at_camera(const CellFrame& base, const CellMember& member) {
  Matrix6d covariance = base.covariance;
  covariance.topLeftCorner<3, 3>() = point_covariance(base, member.poses.X.translation());
  return covariance;
}

}  // namespace

std::vector<std::string> cell_contradictions(const std::vector<CellMember>& members,
                                             const Refinement& refined, const Cell& cell,
                                             const CellCheckSettings& settings) {
  std::vector<std::string> reasons;
  const auto add = [&](const std::string& reason) {
    if (!reason.empty() && std::find(reasons.begin(), reasons.end(), reason) == reasons.end())
      reasons.push_back(reason);
  };
  add(scatter(members, refined.noise, settings.corners));
  for (const CellMember& member : members) add(misplaced(member, cell, settings.away));
  for (std::size_t arm = 0; arm < refined.noise.translation.size(); ++arm) {
    bool unusable = false;
    const std::string noisy =
        unusual_noise({{}, {refined.noise.rotation[arm]}, {refined.noise.translation[arm]}, {}}, unusable);
    if (unusable) add(noisy);
  }
  for (const CellMember& member : members) {
    const double distance = distance_of(member);
    for (const CellFrame& camera : cell.cameras)
      if (camera.transform.child == member.camera)
        add(unknown_place(member.camera, camera.covariance, distance));
    for (const CellFrame& base : cell.bases)
      if (base.transform.child == member.arm)
        add(unknown_place(member.arm, at_camera(base, member), distance));
  }
  return reasons;
}

}  // namespace flash::calib
