#include "calib/geometry/planar_pose.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

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

/// Moves the middle to the origin and the points to a mean distance of sqrt(2) from it.
Eigen::Matrix3d conditioning(const Eigen::Matrix2Xd& points) {
  const Eigen::Vector2d middle = points.rowwise().mean();
  const double scale = std::sqrt(2) / (points.colwise() - middle).colwise().norm().mean();
  Eigen::Matrix3d T = Eigen::Matrix3d::Identity();
  T.topLeftCorner<2, 2>() *= scale;
  T.topRightCorner<2, 1>() = -scale * middle;
  return T;
}

/// H with b ~ H a, least algebraic error, scaled to H(2, 2) = 1 (Hartley and Zisserman 2004, algorithm 4.2).
Eigen::Matrix3d homography(const Eigen::Matrix2Xd& a, const Eigen::Matrix2Xd& b) {
  const Eigen::Matrix3d A = conditioning(a), B = conditioning(b);
  Eigen::Matrix<double, 9, 9> gram = Eigen::Matrix<double, 9, 9>::Zero();
  for (Eigen::Index i = 0; i < a.cols(); ++i) {
    const Eigen::Vector3d p = A * a.col(i).homogeneous(), q = B * b.col(i).homogeneous();
    Eigen::Matrix<double, 2, 9> rows;
    rows << p.transpose(), Eigen::RowVector3d::Zero(), -q.x() * p.transpose(), Eigen::RowVector3d::Zero(),
        p.transpose(), -q.y() * p.transpose();
    gram += rows.transpose() * rows;
  }
  const Eigen::Matrix<double, 9, 1> h =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>>(gram).eigenvectors().col(0);
  Eigen::Matrix3d H;
  H << h.head<3>().transpose(), h.segment<3>(3).transpose(), h.tail<3>().transpose();
  H = B.inverse() * H * A;
  return H / H(2, 2);
}

/// Where a target that is turned by R has to be for its points to lie on their rays, by least squares.
Eigen::Vector3d placed(const Eigen::Matrix3d& R, const Eigen::Matrix3Xd& points,
                       const Eigen::Matrix2Xd& rays) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    Eigen::Matrix<double, 2, 3> rows;
    rows << 1, 0, -rays(0, i), 0, 1, -rays(1, i);
    normal += rows.transpose() * rows;
    right -= rows.transpose() * (rows * (R * points.col(i)));
  }
  return normal.ldlt().solve(right);
}

/// Both poses that have the homography's first derivatives at the middle of the target (Collins and Bartoli
/// 2014, sec. 4). Rays: x / z, y / z of the points.
std::vector<Eigen::Isometry3d> infinitesimal_poses(const Eigen::Matrix3Xd& points,
                                                   const Eigen::Matrix2Xd& rays) {
  const Eigen::Vector3d middle = points.rowwise().mean();
  const Eigen::Matrix3Xd centred = points.colwise() - middle;
  const Eigen::Matrix3d H = homography(centred.topRows<2>(), rays);
  const Eigen::Vector2d at(H(0, 2), H(1, 2));
  const Eigen::Matrix2d J = H.topLeftCorner<2, 2>() - at * H.bottomLeftCorner<1, 2>();
  // Turns the line of sight to z: what is left is seen as from far away.
  const Eigen::Matrix3d V =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), at.homogeneous()).toRotationMatrix();
  const Eigen::Matrix2d B = V.topLeftCorner<2, 2>() - at * V.bottomLeftCorner<1, 2>();
  Eigen::Matrix2d turned = B.inverse() * J;
  turned /= Eigen::JacobiSVD<Eigen::Matrix2d>(turned).singularValues()[0];
  const Eigen::Matrix2d rest = Eigen::Matrix2d::Identity() - turned.transpose() * turned;
  Eigen::Vector2d depth = rest.diagonal().cwiseMax(0).cwiseSqrt();
  if (rest(0, 1) < 0) depth.y() = -depth.y();
  std::vector<Eigen::Isometry3d> poses;
  for (const double sign : {1.0, -1.0}) {
    Eigen::Matrix3d R;
    R.topLeftCorner<2, 2>() = turned;
    R.bottomLeftCorner<1, 2>() = sign * depth.transpose();
    R.col(2) = R.col(0).cross(R.col(1));
    if (!R.allFinite()) continue;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = nearest_rotation(V * R);
    pose.translation() = placed(pose.linear(), centred, rays) - pose.linear() * middle;
    poses.push_back(pose);
  }
  return poses;
}

}  // namespace

std::vector<PlanarPose> planar_poses(const data::CameraIntrinsics& camera, const Eigen::Matrix3Xd& points,
                                     const Eigen::Matrix2Xd& pixels) {
  if (points.cols() < 4 || on_a_line(points)) return {};
  Eigen::Matrix2Xd rays(2, points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    rays.col(i) = data::unproject(camera, pixels.col(i), 1).head<2>();
  if (!rays.allFinite()) return {};
  const IntrinsicsVector intrinsics = to_vector(camera);
  std::vector<PlanarPose> poses;
  for (const Eigen::Isometry3d& start : infinitesimal_poses(points, rays)) {
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
