#include "calib/check/contradiction.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "calib/geometry/pose.h"
#include "calib/solve/pose_space.h"
#include "data/files/text.h"
#include "data/numbers/median.h"

namespace flash::calib {
namespace {

constexpr double kDegrees = 180 / M_PI;
constexpr double kContradicts = 3;  // times the stated error

double ratio_of(double mm, double deg, const StatedError& stated) {
  return std::max(mm / stated.mm, deg / stated.deg);
}

/// The camera where these views want it: X as the mean over the views, with the target where it is said to
/// be.
Eigen::Isometry3d camera_pose_from(Setup setup, const Eigen::Isometry3d& Z,
                                   const std::vector<Observation>& observations) {
  std::vector<Eigen::Isometry3d> poses;
  for (const Observation& view : observations) {
    if (view.T_camera_target.empty()) continue;
    const PoseLoop loop = pose_loop(setup, view.T_base_gripper, view.T_camera_target.front());
    poses.push_back(loop.G.inverse() * Z * loop.C.inverse());
  }
  return mean_pose(poses);
}

std::string moved_by(const Eigen::Isometry3d& before, const Eigen::Isometry3d& now) {
  const Vector6d motion = motion_between(before, now);
  char text[80];
  std::snprintf(text, sizeof text, "by %.1f mm and %.2f deg", 1e3 * motion.head<3>().norm(),
                kDegrees * motion.tail<3>().norm());
  return text;
}

/// The target as it is seen with another size or focal length, wherever these views want it.
struct Rescaled {
  double scale = 1;  ///< over that for which the views have poses
  Eigen::Isometry3d Z;
  std::vector<Observation> observations;  ///< with poses of it
};

/// `scale`: what is free of `with(scale)`, which is linear in places. By least squares of the target's place
/// over the views. None where turns alone leave it open.
std::optional<Rescaled> rescaled_target(Setup setup, const Eigen::Isometry3d& X,
                                        const std::vector<Observation>& observations,
                                        double SeenScales::*scale) {
  const auto with = [&](const Eigen::Isometry3d& seen, double value) {
    SeenScales scales;
    scales.*scale = value;
    return rescaled(seen, scales);
  };
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  for (const Observation& view : observations) {
    if (view.T_camera_target.empty()) continue;
    const PoseLoop loop = pose_loop(setup, view.T_base_gripper, view.T_camera_target.front());
    const Eigen::Isometry3d T_fixed_camera = loop.G * X;
    const Eigen::Vector3d once = with(loop.C, 1).translation(), slope = with(loop.C, 2).translation() - once;
    Eigen::Matrix<double, 3, 4> rows;
    rows << -Eigen::Matrix3d::Identity(), T_fixed_camera.linear() * slope;
    normal += rows.transpose() * rows;
    right -= rows.transpose() * (T_fixed_camera * (once - slope));
  }
  const Eigen::LDLT<Eigen::Matrix4d> solver(normal);
  const double found = solver.solve(right)[3];
  if (!(solver.rcond() > 1e-9 && found > 0)) return std::nullopt;
  Rescaled result{found, {}, observations};
  for (Observation& view : result.observations)
    for (Eigen::Isometry3d& pose : view.T_camera_target) pose = with(pose, found);
  result.Z = target_pose_from(setup, X, result.observations);
  return result;
}

/// Of pairs of poses, whose corners nobody has.
bool are_pairs(const std::vector<Observation>& observations) {
  return std::all_of(observations.begin(), observations.end(),
                     [](const Observation& view) { return view.points.empty(); });
}

/// The view from which on all miss, where all before it do not.
std::string first_that_misses(const ProjectionCheck& check, const StatedError& stated) {
  const auto misses = [&](const ViewProjection& view) {
    return ratio_of(view.mm, view.deg, stated) > kContradicts;
  };
  const auto first = std::find_if(check.views.begin(), check.views.end(), misses);
  const bool step = first != check.views.begin() && std::all_of(first, check.views.end(), misses);
  return step ? ", from " + first->image + " on" : "";
}

}  // namespace

StatedError stated_error(const Extrinsics& extrinsics, double distance) {
  constexpr ClosingError kUsual{.rotation = 0.2 / kDegrees, .translation = 2e-3};
  const ClosingError left_out = extrinsics.held_out.value_or(kUsual);
  const double turn = extrinsics.covariance.bottomRightCorner<3, 3>().trace(),  // two of its three axes shift
      shift = extrinsics.covariance.topLeftCorner<3, 3>().trace() + 2.0 / 3 * turn * distance * distance;
  return {1e3 * std::hypot(left_out.translation, std::sqrt(shift)),
          kDegrees * std::hypot(left_out.rotation, std::sqrt(turn))};
}

Contradiction contradiction(const Extrinsics& extrinsics, const HandEyePoses& poses, bool target_is_refitted,
                            const data::CameraIntrinsics& lens, const Target& target,
                            const std::vector<Observation>& observations, const ProjectionCheck& check) {
  std::vector<double> distances;
  for (const Observation& view : observations)
    if (!view.T_camera_target.empty()) distances.push_back(view.T_camera_target.front().translation().norm());
  if (distances.empty()) return {};
  const StatedError stated = stated_error(extrinsics, data::median(distances));
  Contradiction result{.ratio = ratio_of(check.mm_rms, check.deg_rms, stated), .sentence = {}};
  if (result.ratio <= kContradicts) return result;

  const auto ratio_at = [&](const HandEyePoses& at, const std::vector<Observation>& views, double size = 1) {
    TargetShape shape = extrinsics.target;
    shape.scale *= size;
    const ProjectionCheck moved =
        check_projection(extrinsics.setup, at, lens, target, views, shape, extrinsics.edge_offset);
    return ratio_of(moved.mm_rms, moved.deg_rms, stated);
  };
  const HandEyePoses target_moved{poses.X, target_pose_from(extrinsics.setup, poses.X, observations)};
  // A target that was placed by a camera which has moved is wrong as well: both are taken from the views.
  std::vector<Observation> seen = observations;
  std::erase_if(seen, [](const Observation& view) { return view.T_camera_target.empty(); });
  const HandEyePoses camera_moved =
      target_is_refitted && seen.size() >= 3
          ? shah(pose_loops(extrinsics.setup, seen))
          : HandEyePoses{camera_pose_from(extrinsics.setup, poses.Z, observations), poses.Z};
  const std::optional<Rescaled> resized =
      rescaled_target(extrinsics.setup, poses.X, observations, &SeenScales::size);
  const std::optional<Rescaled> refocused =
      are_pairs(observations)
          ? rescaled_target(extrinsics.setup, poses.X, observations, &SeenScales::focal_length)
          : std::nullopt;
  const double by_target = target_is_refitted ? result.ratio : ratio_at(target_moved, observations),
               by_camera = ratio_at(camera_moved, observations),
               by_size = resized ? ratio_at({poses.X, resized->Z}, resized->observations, resized->scale)
                                 : INFINITY,
               by_lens = refocused ? ratio_at({poses.X, refocused->Z}, refocused->observations) : INFINITY;
  constexpr double as_well = 1.5;  // a camera that moved along its axis looks like it, by six numbers for one
  std::string cause;
  if (by_target <= kContradicts && by_target <= by_camera)
    cause = "the target is not where it was at the calibration, " + moved_by(poses.Z, target_moved.Z) +
            ": these views cannot check the calibration; --refit-target takes its place from them";
  else if (by_lens <= kContradicts && by_lens <= by_size && by_lens <= as_well * by_camera)
    cause =
        "the camera's focal length is " + data::format_short(refocused->scale * extrinsics.focal_length) +
        " times that with which these poses were made, and was " +
        data::format_short(extrinsics.focal_length) +
        " times at the calibration: poses made with another lens; these views cannot check the calibration";
  else if (by_size <= kContradicts && by_size <= by_camera)
    cause = "the target is " + data::format_short(resized->scale * extrinsics.target.scale) +
            " times as large as stated, and was " + data::format_short(extrinsics.target.scale) +
            " times at the calibration: another print, or another size stated; these views cannot check the "
            "calibration: measure a square";
  else if (by_camera <= kContradicts)
    cause = "the camera is not where it was at the calibration, " + moved_by(poses.X, camera_moved.X) +
            ": calibrate again";
  else
    cause =
        "neither a target nor a camera that was moved explains it: another setup, target, robot or lens, "
        "something that moved meanwhile, or a robot that errs more in these poses";
  char text[160];
  std::snprintf(text, sizeof text,
                "the target is missed by %.1f mm and %.2f deg (rms%s), where the calibration states %.1f mm "
                "and %.2f deg: ",
                check.mm_rms, check.deg_rms, first_that_misses(check, stated).c_str(), stated.mm, stated.deg);
  result.sentence = text + cause;
  return result;
}

}  // namespace flash::calib
