#include "calib/geometry/closed_form.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/geometry/pose.h"

namespace flash::calib {
namespace {

constexpr double kNoTilt = 0.004;  // of turns about one axis [rad], and of the singular values that it makes

/// Least squares for t_X and t_Z of R_G (R_X t_C s + t_X) + t_G = t_Z; with `scale` also for s.
Eigen::VectorXd solve_translations(const std::vector<PoseLoop>& loops, const Eigen::Matrix3d& R_X,
                                   bool scale) {
  const auto count = static_cast<Eigen::Index>(loops.size());
  Eigen::MatrixXd A(3 * count, scale ? 7 : 6);
  Eigen::VectorXd b(3 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const PoseLoop& loop = loops[static_cast<std::size_t>(i)];
    const Eigen::Vector3d lever = loop.G.linear() * R_X * loop.C.translation();
    A.block<3, 3>(3 * i, 0) = loop.G.linear();
    A.block<3, 3>(3 * i, 3) = -Eigen::Matrix3d::Identity();
    if (scale) A.block<3, 1>(3 * i, 6) = lever;
    b.segment<3>(3 * i) = -loop.G.translation() - (scale ? Eigen::Vector3d::Zero().eval() : lever);
  }
  // Minimum norm where the rotations do not determine it: tilts of a fifth of a degree are noise.
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
  if (!scale) decomposition.setThreshold(kNoTilt);
  return decomposition.compute(A).solve(b);
}

/// The vector that a rotation turns about, by the sine of its angle: continuous beyond half a turn.
Eigen::Vector3d sine_axis(const Eigen::Matrix3d& R) {
  return 0.5 * Eigen::Vector3d(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
}

/// Closing errors, translations over the distance to the target.
double combined(const std::vector<PoseLoop>& loops, const HandEyePoses& poses) {
  double distance = 0;
  for (const PoseLoop& loop : loops)
    distance += loop.C.translation().norm() / static_cast<double>(loops.size());
  const ClosingError error = closing_rms(loops, poses);
  return std::hypot(error.rotation, error.translation / std::max(distance, 1e-9));
}

}  // namespace

PoseLoop pose_loop(Setup setup, const Eigen::Isometry3d& T_base_gripper,
                   const Eigen::Isometry3d& T_camera_target) {
  return {setup == Setup::eye_in_hand ? T_base_gripper : T_base_gripper.inverse(), T_camera_target};
}

HandEyePoses park(const std::vector<PoseLoop>& loops) {
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < loops.size(); ++i) {
    for (std::size_t j = i + 1; j < loops.size(); ++j) {
      const Eigen::Matrix3d A = loops[j].G.linear().transpose() * loops[i].G.linear();
      const Eigen::Matrix3d B = loops[j].C.linear() * loops[i].C.linear().transpose();
      M += rotation_log(A) * rotation_log(B).transpose();
    }
  }
  HandEyePoses poses;
  poses.X.linear() = nearest_rotation(M);
  poses.X.translation() = solve_translations(loops, poses.X.linear(), false).head<3>();
  std::vector<Eigen::Isometry3d> targets;
  targets.reserve(loops.size());
  for (const PoseLoop& loop : loops) targets.push_back(loop.G * poses.X * loop.C);
  poses.Z = mean_pose(targets);
  return poses;
}

HandEyePoses half_turns(const std::vector<PoseLoop>& loops) {
  const auto turn_of = [](const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
    return rotation_log(a.linear() * b.linear());
  };
  Eigen::Vector3d robot[2], camera[2];
  for (std::size_t k = 0; k < 2; ++k) {
    robot[k] = turn_of(loops[k + 1].G.inverse(), loops[0].G);
    camera[k] = turn_of(loops[k + 1].C, loops[0].C.inverse());
  }
  HandEyePoses best;
  double least = std::numeric_limits<double>::infinity();
  for (const double first : {1.0, -1.0})
    for (const double second : {1.0, -1.0}) {
      const Eigen::Vector3d b[2] = {first * camera[0], second * camera[1]};
      HandEyePoses poses;
      poses.X.linear() = nearest_rotation(robot[0] * b[0].transpose() + robot[1] * b[1].transpose() +
                                          robot[0].cross(robot[1]) * b[0].cross(b[1]).transpose());
      poses.X.translation() = solve_translations(loops, poses.X.linear(), false).head<3>();
      std::vector<Eigen::Isometry3d> targets;
      for (const PoseLoop& loop : loops) targets.push_back(loop.G * poses.X * loop.C);
      poses.Z = mean_pose(targets);
      const double score = combined(loops, poses);
      if (score >= least) continue;
      least = score;
      best = poses;
    }
  return best;
}

HandEyePoses of_one_axis(const std::vector<PoseLoop>& loops) {
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < loops.size(); ++i)
    for (std::size_t j = i + 1; j < loops.size(); ++j)
      M += sine_axis(loops[j].G.linear().transpose() * loops[i].G.linear()) *
           sine_axis(loops[j].C.linear() * loops[i].C.linear().transpose()).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d axis = svd.matrixU().col(0);
  const Eigen::Matrix3d R = Eigen::Quaterniond::FromTwoVectors(svd.matrixV().col(0), axis).toRotationMatrix();
  // R_G (R(phi) R t_C + t_X) + t_G = t_Z is linear in cos phi and sin phi.
  const auto count = static_cast<Eigen::Index>(loops.size());
  Eigen::MatrixXd A(3 * count, 8);
  Eigen::VectorXd b(3 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const PoseLoop& loop = loops[static_cast<std::size_t>(i)];
    const Eigen::Vector3d p = R * loop.C.translation(), along = axis * axis.dot(p);
    A.block<3, 1>(3 * i, 0) = loop.G.linear() * (p - along);
    A.block<3, 1>(3 * i, 1) = loop.G.linear() * axis.cross(p);
    A.block<3, 3>(3 * i, 2) = loop.G.linear();
    A.block<3, 3>(3 * i, 5) = -Eigen::Matrix3d::Identity();
    b.segment<3>(3 * i) = -loop.G.translation() - loop.G.linear() * along;
  }
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
  decomposition.setThreshold(kNoTilt);
  const Eigen::VectorXd x = decomposition.compute(A).solve(b);
  HandEyePoses poses;
  poses.X.linear() = rotation_exp(std::atan2(x[1], x[0]) * axis) * R;
  const Eigen::VectorXd t = solve_translations(loops, poses.X.linear(), false);
  poses.X.translation() = t.head<3>();
  poses.Z.translation() = t.tail<3>();
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const PoseLoop& loop : loops) sum += loop.G.linear() * poses.X.linear() * loop.C.linear();
  poses.Z.linear() = nearest_rotation(sum);
  return poses;
}

HandEyePoses better_of(const std::vector<PoseLoop>& loops, const HandEyePoses& a, const HandEyePoses& b) {
  return combined(loops, b) < combined(loops, a) ? b : a;
}

HandEyePoses shah(const std::vector<PoseLoop>& loops) {
  // R_G R_X R_C = R_Z, so vec(R_X) goes to vec(R_Z) under kron(R_C^T, R_G), columns stacked.
  Eigen::Matrix<double, 9, 9> K = Eigen::Matrix<double, 9, 9>::Zero();
  for (const PoseLoop& loop : loops)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) K.block<3, 3>(3 * i, 3 * j) += loop.C.linear()(j, i) * loop.G.linear();
  const Eigen::JacobiSVD<Eigen::Matrix<double, 9, 9>> svd(K, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const auto rotation_of = [](const Eigen::Matrix<double, 9, 1>& v) {
    const Eigen::Matrix3d m = Eigen::Map<const Eigen::Matrix3d>(v.data());
    return nearest_rotation(m.determinant() < 0 ? Eigen::Matrix3d(-m) : m);
  };
  HandEyePoses poses;
  poses.X.linear() = rotation_of(svd.matrixV().col(0));
  poses.Z.linear() = rotation_of(svd.matrixU().col(0));
  const Eigen::VectorXd t = solve_translations(loops, poses.X.linear(), false);
  poses.X.translation() = t.head<3>();
  poses.Z.translation() = t.tail<3>();
  return poses;
}

ClosingError closing_error(const PoseLoop& loop, const HandEyePoses& poses) {
  const Eigen::Isometry3d error = poses.Z.inverse() * loop.G * poses.X * loop.C;
  return {rotation_angle(error.linear()), error.translation().norm()};
}

ClosingError closing_rms(const std::vector<PoseLoop>& loops, const HandEyePoses& poses) {
  ClosingError sum;
  for (const PoseLoop& loop : loops) {
    const ClosingError error = closing_error(loop, poses);
    sum.rotation += error.rotation * error.rotation / static_cast<double>(loops.size());
    sum.translation += error.translation * error.translation / static_cast<double>(loops.size());
  }
  return {std::sqrt(sum.rotation), std::sqrt(sum.translation)};
}

ClosingError relative_rms(const std::vector<PoseLoop>& loops, const Eigen::Isometry3d& X) {
  ClosingError sum;
  double count = 0;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    for (std::size_t j = i + 1; j < loops.size(); ++j, ++count) {
      const Eigen::Isometry3d AX = loops[j].G.inverse() * loops[i].G * X;
      const Eigen::Isometry3d XB = X * loops[j].C * loops[i].C.inverse();
      const double angle = rotation_angle(AX.linear().transpose() * XB.linear());
      sum.rotation += angle * angle;
      sum.translation += (AX.translation() - XB.translation()).squaredNorm();
    }
  }
  return {std::sqrt(sum.rotation / count), std::sqrt(sum.translation / count)};
}

double translation_scale(const std::vector<PoseLoop>& loops, const HandEyePoses& poses) {
  return solve_translations(loops, poses.X.linear(), true)[6];
}

}  // namespace flash::calib
