#include "calib/check/projection_check.h"

#include <cmath>

#include "calib/geometry/chain.h"
#include "calib/geometry/pose.h"
#include "calib/geometry/pose_from_pixels.h"

namespace flash::calib {
namespace {

/// Of the poses that fit a view, the one nearest to what the chain says.
const Eigen::Isometry3d& nearest(const std::vector<Eigen::Isometry3d>& poses,
                                 const Eigen::Isometry3d& expected) {
  const Eigen::Isometry3d* best = &poses.front();
  const auto angle = [&](const Eigen::Isometry3d& pose) {
    return rotation_angle(pose.linear().transpose() * expected.linear());
  };
  for (const Eigen::Isometry3d& pose : poses)
    if (angle(pose) < angle(*best)) best = &pose;
  return *best;
}

/// Pixel, or far outside of any picture where the point lies behind the camera.
Eigen::Vector2d pixel_of(const data::CameraIntrinsics& camera, const Eigen::Vector3d& point) {
  return data::project(camera, point).value_or(Eigen::Vector2d::Constant(-1e4));
}

/// A way to number the points, and the turn of the target about its middle that does the same.
struct Numbering {
  const std::vector<int>* permutation;
  Eigen::Isometry3d turn;
};

Numbering numbering(const Eigen::Matrix3Xd& points, const std::vector<int>& permutation) {
  Eigen::Matrix3Xd turned(3, points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    turned.col(i) = points.col(permutation[static_cast<std::size_t>(i)]);
  return {&permutation, Eigen::Isometry3d(Eigen::umeyama(points, turned, false))};
}

ViewProjection project_view(const Eigen::Isometry3d& T_camera_target, const data::CameraIntrinsics& camera,
                            const Eigen::Matrix3Xd& points, const Numbering& numbering,
                            const Observation& view, double edge_offset) {
  ViewProjection result;
  result.image = view.image;
  result.projected.resize(2, view.pixels.cols());
  for (Eigen::Index i = 0; i < view.pixels.cols(); ++i) {
    const int point = view.points[static_cast<std::size_t>(i)];
    result.points.push_back((*numbering.permutation)[static_cast<std::size_t>(point)]);
    result.projected.col(i) = pixel_of(camera, T_camera_target * points.col(result.points.back()));
  }
  if (view.outward.cols() > 0) result.projected += edge_offset * view.outward;
  if (view.pixels.cols() > 0)
    result.corner_rms =
        std::sqrt((result.projected - view.pixels).squaredNorm() / static_cast<double>(view.pixels.cols()));
  const Eigen::Vector3d middle = points.rowwise().mean();
  // The view's own pose is of the target as the view numbers it.
  const Eigen::Isometry3d expected = T_camera_target * numbering.turn;
  const Eigen::Isometry3d& own = nearest(view.T_camera_target, expected);
  if (view.pixels.cols() > 0)
    result.centre = (pixel_of(camera, expected * middle) - pixel_of(camera, own * middle)).norm();
  result.mm = 1e3 * (expected * middle - own * middle).norm();
  result.deg = rotation_angle(own.linear().transpose() * expected.linear()) * 180 / M_PI;
  return result;
}

}  // namespace

ProjectionCheck check_projection(Setup setup, const HandEyePoses& poses, const data::CameraIntrinsics& camera,
                                 const Target& target, const std::vector<Observation>& observations,
                                 const TargetShape& shape, double edge_offset) {
  const Eigen::Matrix3Xd flat = target_points(target), points = shaped(flat, target_bows(flat), shape);
  const std::vector<std::vector<int>> symmetries = target_symmetries(target);
  std::vector<Numbering> numberings;
  for (const std::vector<int>& symmetry : symmetries)
    numberings.push_back(numbering(shape.scale * flat, symmetry));
  ProjectionCheck check;
  double corners = 0, squares = 0, centres = 0, mm = 0, deg = 0;
  for (const Observation& view : observations) {
    if (view.T_camera_target.empty()) continue;
    const Chain chain(setup, poses.X, Eigen::Isometry3d::Identity(), view.T_base_gripper,
                      Eigen::Isometry3d::Identity(), poses.Z);
    ViewProjection best;
    for (std::size_t k = 0; k < numberings.size(); ++k) {
      ViewProjection projection =
          project_view(chain.target_in_camera(), camera, points, numberings[k], view, edge_offset);
      const bool better =
          view.pixels.cols() > 0 ? projection.corner_rms < best.corner_rms : projection.deg < best.deg;
      if (k == 0 || better) best = std::move(projection);
    }
    const double count = static_cast<double>(view.pixels.cols());
    corners += count;
    squares += count * best.corner_rms * best.corner_rms;
    centres += best.centre * best.centre;
    mm += best.mm * best.mm;
    deg += best.deg * best.deg;
    check.views.push_back(std::move(best));
  }
  const double views = std::max(1.0, static_cast<double>(check.views.size()));
  check.corner_rms = std::sqrt(squares / std::max(1.0, corners));
  check.centre_rms = std::sqrt(centres / views);
  check.mm_rms = std::sqrt(mm / views);
  check.deg_rms = std::sqrt(deg / views);
  return check;
}

std::vector<Observation> with_poses_for(const data::CameraIntrinsics& camera, const Target& target,
                                        const TargetShape& shape, std::vector<Observation> observations,
                                        double edge_offset) {
  const Eigen::Matrix3Xd flat = target_points(target), points = shaped(flat, target_bows(flat), shape);
  for (Observation& observation : observations) {
    Eigen::Matrix2Xd pixels = observation.pixels;
    if (observation.outward.cols() > 0) pixels -= edge_offset * observation.outward;
    for (Eigen::Isometry3d& T : observation.T_camera_target) {
      T.translation() *= shape.scale;
      if (pixels.cols() > 0) T = fitted_pose(camera, points(Eigen::all, observation.points), pixels, T);
    }
  }
  return observations;
}

std::vector<Observation> with_scales(std::vector<Observation> pairs, const SeenScales& scales) {
  for (Observation& pair : pairs)
    for (Eigen::Isometry3d& T : pair.T_camera_target) T = rescaled(T, scales);
  return pairs;
}

Eigen::Isometry3d target_pose_from(Setup setup, const Eigen::Isometry3d& X,
                                   const std::vector<Observation>& observations) {
  std::vector<Eigen::Isometry3d> poses;
  for (const Observation& view : observations) {
    if (view.T_camera_target.empty()) continue;
    const PoseLoop loop = pose_loop(setup, view.T_base_gripper, view.T_camera_target.front());
    poses.push_back(loop.G * X * loop.C);
  }
  return mean_pose(poses);
}

}  // namespace flash::calib
