#include "calib/calibrate/next_poses.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>

#include "calib/geometry/projection.h"
#include "calib/solve/linearization.h"
#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::calib {
namespace {

struct Candidate {
  Eigen::Isometry3d T_base_gripper;
  Eigen::MatrixXd information;  // of the shared unknowns
};

/// Seen whole, from the front, with a margin.
bool visible(const Eigen::Isometry3d& T_camera_target, const data::CameraIntrinsics& camera,
             const Eigen::Matrix3Xd& points, const PlanSettings& settings) {
  const Eigen::Vector3d sight = (T_camera_target * Eigen::Vector3d(points.rowwise().mean())).normalized();
  if (sight.dot(T_camera_target.linear().col(2)) < std::cos(settings.steepest)) return false;
  const IntrinsicsVector intrinsics = to_vector(camera);
  const double margin = settings.margin * camera.width;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3d q = T_camera_target * points.col(i);
    if (!(q.z() > 0.02)) return false;
    const Eigen::Vector2d px = project(intrinsics, q);
    if (px.minCoeff() < margin || px.x() > camera.width - margin || px.y() > camera.height - margin)
      return false;
  }
  return true;
}

/// What one more view tells of the shared unknowns: its corners, with its robot pose known to its noise.
/// scene: without poses and views; view: what is seen of the target, its pixels of no account, as only
/// derivatives of residuals count.
Eigen::MatrixXd view_information(Bundle& scene, const Eigen::Isometry3d& T_base_gripper,
                                 const BundleView& view, const NoiseLevels& noise, const Unknowns& unknowns,
                                 const SharedColumns& columns) {
  scene.poses.front().T_base_gripper = T_base_gripper;
  double count = 0;
  const Eigen::MatrixXd gram = corner_gram(scene, view, unknowns, columns, noise.corner.front(), 0, count) /
                               (noise.corner.front() * noise.corner.front());
  const int s = columns.count;
  Matrix6d own = gram.topLeftCorner<6, 6>();
  own.diagonal().head<3>().array() += 1 / (noise.translation.front() * noise.translation.front());
  own.diagonal().tail<3>().array() += 1 / (noise.rotation.front() * noise.rotation.front());
  const Eigen::MatrixXd cross = gram.block(0, 6, 6, s);
  return gram.block(6, 6, s, s) - cross.transpose() * own.ldlt().solve(cross);
}

Matrix6d camera_covariance(const Eigen::MatrixXd& information) {
  return information.ldlt()
      .solve(Eigen::MatrixXd::Identity(information.rows(), information.cols()))
      .topLeftCorner<6, 6>();
}

double worth(const Matrix6d& covariance, PlanCriterion criterion, double length) {
  if (criterion == PlanCriterion::determinant) return covariance.determinant();
  return covariance.topLeftCorner<3, 3>().trace() +
         length * length * covariance.bottomRightCorner<3, 3>().trace();
}

/// About which the candidates of an arm that cannot tilt turn, in the gripper.
std::optional<Eigen::Vector3d> only_axis(const Calibration& calibration, const PlanSettings& settings) {
  if (!settings.one_axis) return std::nullopt;
  if (!calibration.along)
    throw data::InputError("plan: --four-axes: the robot turns about more than one axis; leave it out");
  const OneAxis& axis = calibration.along->axis;
  return calibration.setup == Setup::eye_in_hand ? axis.camera : axis.target;
}

/// What is known of X and Z, and nothing of a place along the axis that is merely held.
Eigen::MatrixXd information_of(const Calibration& calibration, const SharedColumns& columns, double loose,
                               const PlanSettings& settings) {
  Eigen::MatrixXd information =
      calibration.refined.covariance.ldlt().solve(Eigen::MatrixXd::Identity(columns.count, columns.count));
  const std::optional<AlongPrior>& held = calibration.refined.bundle.priors.along;
  if (!held || !calibration.along || calibration.along->told || settings.one_axis) return information;
  const int first = (held->target ? columns.targets : columns.cameras).front();
  const Eigen::Matrix<double, 1, 6> row =
      along_residual(*held, held->target ? calibration.poses.Z : calibration.poses.X).by_pose;
  information.block<6, 6>(first, first) -= (1 - std::pow(held->sd / loose, 2)) * row.transpose() * row;
  return information;
}

/// Where in the camera's frame the middle of the target may be.
struct Sight {
  Eigen::Vector3d middle;    // of the target, in its frame
  double nearest, farthest;  // as the views so far, and `reach` beyond [m]
  Eigen::Vector2d across;    // half of the picture, tangents
};

Sight sight_of(const Calibration& calibration, const Eigen::Matrix3Xd& points, const PlanSettings& settings) {
  const Bundle& bundle = calibration.refined.bundle;
  const data::CameraIntrinsics& camera = bundle.intrinsics.front();
  Sight sight{.middle = points.rowwise().mean(),
              .nearest = std::numeric_limits<double>::infinity(),
              .farthest = 0,
              .across = {0.5 * camera.width / camera.fx, 0.5 * camera.height / camera.fy}};
  for (const BundleView& view : bundle.views) {
    const double distance = (predicted_pose(bundle, view) * sight.middle).z();
    sight.nearest = std::min(sight.nearest, distance);
    sight.farthest = std::max(sight.farthest, distance);
  }
  sight.nearest = std::max(0.5 * sight.nearest, sight.nearest - settings.reach);
  sight.farthest += settings.reach;
  return sight;
}

/// Where a gripper of that orientation is while the camera sees `middle` of the target at `place`.
Eigen::Vector3d looking_from(const Calibration& calibration, const Eigen::Matrix3d& orientation,
                             const Eigen::Vector3d& place, const Eigen::Vector3d& middle) {
  const Eigen::Vector3d seen = calibration.poses.X * place, held = calibration.poses.Z * middle;
  return calibration.setup == Setup::eye_in_hand ? Eigen::Vector3d(held - orientation * seen)
                                                 : Eigen::Vector3d(seen - orientation * held);
}

std::vector<Eigen::Isometry3d> draw_poses(const Calibration& calibration, const Eigen::Matrix3Xd& points,
                                          const std::optional<Eigen::Vector3d>& axis,
                                          const PlanSettings& settings) {
  const Bundle& bundle = calibration.refined.bundle;
  Eigen::Vector3d lower = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), upper = -lower;
  std::vector<Eigen::Isometry3d> used;
  for (const RobotPose& pose : bundle.poses) {
    used.push_back(pose.T_base_gripper);
    lower = lower.cwiseMin(pose.T_base_gripper.translation());
    upper = upper.cwiseMax(pose.T_base_gripper.translation());
  }
  for (Eigen::Index k = 0; k < 3; ++k)
    if (settings.lower[k] > settings.upper[k])
      throw data::InputError("plan: --lower " + data::format_short(settings.lower[k]) + " is above --upper " +
                             data::format_short(settings.upper[k]) + " along " + "xyz"[k]);
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(settings.reach);
  lower -= reach;
  upper += reach;
  for (Eigen::Index k = 0; k < 3; ++k)
    if (settings.lower[k] > upper[k] || settings.upper[k] < lower[k])
      throw data::InputError("plan: --lower, --upper: found " + data::format_short(settings.lower[k]) +
                             " to " + data::format_short(settings.upper[k]) + " m along " + "xyz"[k] +
                             ", expected to meet what the poses so far can reach, " +
                             data::format_short(lower[k]) + " to " + data::format_short(upper[k]) +
                             " m; --reach says how far beyond them");
  lower = lower.cwiseMax(settings.lower);
  upper = upper.cwiseMin(settings.upper);
  const Sight sight = sight_of(calibration, points, settings);
  const Eigen::Matrix3d mean = mean_pose(used).linear();
  std::mt19937 random(settings.seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto between = [&](double low, double high) { return low + (high - low) * uniform(random); };
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < settings.candidates; ++i) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    // Half from views that are known to work, turned; half from their mean orientation.
    const auto from = static_cast<std::size_t>(uniform(random) * static_cast<double>(used.size()));
    const double heading = 2 * M_PI * uniform(random), tilt = settings.tilt * std::sqrt(uniform(random));
    const double turn = between(-settings.turn, settings.turn);
    const Eigen::Matrix3d& start = i % 2 == 0 ? mean : used[from].linear();
    if (axis)
      T.linear() = start * rotation_exp(turn * *axis);
    else
      T.linear() = start * rotation_exp({tilt * std::cos(heading), tilt * std::sin(heading), 0}) *
                   rotation_exp({0, 0, turn});
    // There where the middle of the target is seen at some place of the picture, at some distance.
    const double distance = between(sight.nearest, sight.farthest);
    const Eigen::Vector3d place(distance * between(-sight.across.x(), sight.across.x()),
                                distance * between(-sight.across.y(), sight.across.y()), distance);
    T.translation() = looking_from(calibration, T.linear(), place, sight.middle);
    if ((T.translation() - lower).minCoeff() < 0 || (upper - T.translation()).minCoeff() < 0)
      for (int k = 0; k < 3; ++k) T.translation()[k] = between(lower[k], upper[k]);
    poses.push_back(T);
  }
  return poses;
}

}  // namespace

Plan plan_poses(const Calibration& calibration, const Eigen::Matrix3Xd& points,
                const PlanSettings& settings) {
  const Bundle& bundle = calibration.refined.bundle;
  const NoiseLevels& noise = calibration.refined.noise;
  const Unknowns& unknowns = calibration.unknowns;
  const SharedColumns columns = shared_columns(bundle, unknowns);
  Bundle scene = bundle;
  scene.poses.assign(1, RobotPose{});
  scene.views.clear();
  BundleView view;
  view.points = points;
  view.pixels.setZero(2, points.cols());
  view.bows = target_bows(points);
  std::vector<Candidate> candidates;
  for (const Eigen::Isometry3d& T :
       draw_poses(calibration, points, only_axis(calibration, settings), settings)) {
    const PoseLoop loop = pose_loop(bundle.setup, T, Eigen::Isometry3d::Identity());
    const Eigen::Isometry3d T_camera_target =
        calibration.poses.X.inverse() * loop.G.inverse() * calibration.poses.Z;
    if (!visible(T_camera_target, bundle.intrinsics.front(), points, settings)) continue;
    candidates.push_back({T, view_information(scene, T, view, noise, unknowns, columns)});
  }
  if (candidates.empty())
    throw data::InputError("plan: of " + std::to_string(settings.candidates) +
                           " poses within the bounds none sees the whole target; widen the bounds");
  Plan plan;
  plan.visible = static_cast<int>(candidates.size());
  double length = 0;
  for (const Observation& observation : calibration.selection.observations)
    if (!observation.T_camera_target.empty())
      length = std::max(length, observation.T_camera_target.front().translation().norm());

  const auto sd = [](const Matrix6d& covariance, bool rotation) {
    return std::sqrt(
        (rotation ? covariance.bottomRightCorner<3, 3>() : covariance.topLeftCorner<3, 3>()).trace() / 3);
  };
  Eigen::MatrixXd information = information_of(calibration, columns, length, settings);
  const Matrix6d start = camera_covariance(information);
  plan.translation_sd = sd(start, false);
  plan.rotation_sd = sd(start, true);
  for (int i = 0; i < settings.poses && !candidates.empty(); ++i) {
    const Candidate* best = nullptr;
    Matrix6d best_covariance;
    double least = std::numeric_limits<double>::infinity();
    for (const Candidate& candidate : candidates) {
      const Matrix6d covariance = camera_covariance(information + candidate.information);
      const double value = worth(covariance, settings.criterion, length);
      if (!(value < least)) continue;
      least = value;
      best = &candidate;
      best_covariance = covariance;
    }
    information += best->information;
    plan.poses.push_back({best->T_base_gripper, sd(best_covariance, false), sd(best_covariance, true)});
    candidates.erase(candidates.begin() + (best - candidates.data()));  // a pose twice shows its errors once
  }
  return plan;
}

}  // namespace flash::calib
