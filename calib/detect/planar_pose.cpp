#include "calib/detect/planar_pose.h"

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "calib/geometry/pose.h"
#include "calib/geometry/projection.h"

namespace flash::calib {
namespace {

constexpr int kSteps = 50;

double squared_error(const IntrinsicsVector& intrinsics, const Eigen::Isometry3d& pose,
                     const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& pixels) {
  double sum = 0;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3d p = pose * points.col(i);
    if (!(p.z() > 0)) return std::numeric_limits<double>::infinity();
    sum += (project(intrinsics, p) - pixels.col(i)).squaredNorm();
  }
  return sum;
}

/// Levenberg and Marquardt on the reprojection.
PlanarPose refined(const IntrinsicsVector& intrinsics, Eigen::Isometry3d pose, const Eigen::Matrix3Xd& points,
                   const Eigen::Matrix2Xd& pixels) {
  double cost = squared_error(intrinsics, pose, points, pixels), damping = 1e-6;
  for (int step = 0; step < kSteps && std::isfinite(cost); ++step) {
    Matrix6d normal = Matrix6d::Zero();
    Vector6d gradient = Vector6d::Zero();
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      Eigen::Matrix<double, 2, 3> by_point;
      const Eigen::Vector2d error = pixels.col(i) - project(intrinsics, pose * points.col(i), &by_point);
      // pose moved by xi carries p to R (p + dt - [p]x dtheta) + t.
      Eigen::Matrix<double, 3, 6> motion;
      motion << pose.linear(), -pose.linear() * skew(points.col(i));
      const Eigen::Matrix<double, 2, 6> row = by_point * motion;
      normal += row.transpose() * row;
      gradient += row.transpose() * error;
    }
    bool better = false;
    double moved_cost = cost;
    for (; !better && damping < 1e8; damping *= better ? 1 : 10) {
      Matrix6d damped = normal;
      damped.diagonal() *= 1 + damping;
      const Eigen::Isometry3d next = moved(pose, damped.ldlt().solve(gradient));
      moved_cost = squared_error(intrinsics, next, points, pixels);
      better = moved_cost < cost;
      if (better) pose = next;
    }
    if (!better) break;
    damping = std::max(1e-12, damping / 10);
    const bool settled = cost - moved_cost < 1e-12 * cost;
    cost = moved_cost;
    if (settled) break;
  }
  pose.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
  return {pose, std::sqrt(cost / static_cast<double>(points.cols()))};
}

bool on_a_line(const Eigen::Matrix3Xd& points) {
  const Eigen::Matrix3Xd centred = points.colwise() - points.rowwise().mean();
  const Eigen::Vector3d spread = Eigen::JacobiSVD<Eigen::Matrix3Xd>(centred).singularValues();
  return spread[1] < 1e-3 * spread[0];
}

}  // namespace

std::vector<PlanarPose> planar_poses(const data::CameraIntrinsics& camera, const Eigen::Matrix3Xd& points,
                                     const Eigen::Matrix2Xd& pixels) {
  if (points.cols() < 4 || on_a_line(points)) return {};
  std::vector<cv::Point3d> board;
  std::vector<cv::Point2d> rays;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3d ray = data::unproject(camera, pixels.col(i), 1);
    board.emplace_back(points(0, i), points(1, i), points(2, i));
    rays.emplace_back(ray.x(), ray.y());
  }
  std::vector<cv::Mat> rotations, translations;
  try {
    cv::solvePnPGeneric(board, rays, cv::Matx33d::eye(), cv::noArray(), rotations, translations, false,
                        cv::SOLVEPNP_IPPE);
  } catch (const cv::Exception&) {
    return {};  // corners that no plane can show
  }
  const IntrinsicsVector intrinsics = to_vector(camera);
  std::vector<PlanarPose> poses;
  for (std::size_t k = 0; k < rotations.size(); ++k) {
    const Eigen::Map<const Eigen::Vector3d> turn(rotations[k].ptr<double>()),
        shift(translations[k].ptr<double>());
    Eigen::Isometry3d start = Eigen::Isometry3d::Identity();
    start.linear() = rotation_exp(turn);
    start.translation() = shift;
    if (!start.matrix().allFinite()) continue;
    const PlanarPose pose = refined(intrinsics, start, points, pixels);
    const bool known = std::any_of(poses.begin(), poses.end(), [&](const PlanarPose& other) {
      return rotation_angle(other.T_camera_target.linear().transpose() * pose.T_camera_target.linear()) <
             1e-3;
    });
    if (std::isfinite(pose.rms) && !known) poses.push_back(pose);
  }
  std::sort(poses.begin(), poses.end(),
            [](const PlanarPose& a, const PlanarPose& b) { return a.rms < b.rms; });
  return poses;
}

}  // namespace flash::calib
