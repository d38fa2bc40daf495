#include "calib/calibrate/cell_motion.h"

#include <algorithm>

#include "calib/calibrate/cell_misfits.h"
#include "data/files/error.h"

namespace flash::calib {
namespace {

bool tells_motion(const Calibration& calibration) {
  return calibration.other_part.has_value() || calibration.drift.has_value();
}

/// The poses as the others see them; how many of them they saw.
struct SeenPoses {
  std::vector<Eigen::Isometry3d> T_base_gripper;
  std::size_t seen = 0;
};

SeenPoses seen_by(const Refinement& others, const std::vector<Eigen::Isometry3d>& reported) {
  SeenPoses result{.T_base_gripper = reported};
  for (Eigen::Isometry3d& pose : result.T_base_gripper) {
    const auto same =
        std::find_if(others.bundle.poses.begin(), others.bundle.poses.end(),
                     [&](const RobotPose& other) { return same_pose(other.T_base_gripper, pose); });
    if (same == others.bundle.poses.end()) continue;
    pose = pose * same->correction;
    ++result.seen;
  }
  return result;
}

/// What others make of the arm's poses, lenses and prints being what they found.
Refinement refined(const std::vector<CellMember>& others) {
  RefineSettings settings;
  settings.bundle.unknowns.warps = settings.bundle.unknowns.edge_offsets = true;
  Bundle bundle = cell_bundle(without_wrong_poses(others));
  settings.bundle.unknowns.joint_errors = !bundle.joint_errors.empty();
  return refine(std::move(bundle), settings);
}

/// Counts with all views that fit, at the poses that the robot reported.
CellMember still_member(const CellRecording& recording, const Calibration& still) {
  CellMember member = recording.member;
  member.observations.clear();
  member.stamps.clear();
  member.misfits.clear();
  for (std::size_t view = 0; view < still.selection.views.size(); ++view) {
    Observation seen = still.selection.observations[view];
    seen.T_base_gripper = recording.T_base_gripper[view];
    const double stamp = recording.stamps[view];
    if (still.selection.views[view].misfit)
      member.misfits.push_back({seen.image, stamp, seen.T_base_gripper});
    if (!still.selection.views[view].used) continue;
    member.observations.push_back(std::move(seen));
    member.stamps.push_back(stamp);
  }
  member.poses = still.poses;
  member.motion_covariance = still.motion_covariance;
  return member;
}

}  // namespace

std::vector<std::string> settle_motions(std::vector<CellRecording>& recordings) {
  std::vector<std::string> sentences;
  const std::vector<CellRecording> given = recordings;
  for (CellRecording& recording : recordings) {
    if (!tells_motion(recording.calibration)) continue;
    std::vector<CellMember> others;
    std::string names;
    for (const CellRecording& other : given) {
      if (other.member.arm != recording.member.arm || tells_motion(other.calibration)) continue;
      others.push_back(other.member);
      names += (names.empty() ? "" : ", ") + other.member.camera;
    }
    if (others.empty()) continue;
    const SeenPoses seen = seen_by(refined(others), recording.T_base_gripper);
    if (2 * seen.seen < recording.T_base_gripper.size()) continue;
    try {
      Calibration still = recording.solve(seen.T_base_gripper);
      if (tells_motion(still)) continue;
      recording.member = still_member(recording, still);
      recording.calibration = std::move(still);
    } catch (const data::InputError&) {
      continue;
    }
    sentences.push_back(recording.member.camera + ": by itself it tells of a motion, which " + names +
                        " did not see: it was the robot's error");
  }
  return sentences;
}

}  // namespace flash::calib
