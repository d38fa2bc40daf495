#pragma once
#include <Eigen/Geometry>
#include <vector>

namespace flash::calib {

/// A small motion xi = (dt, dtheta) of a pose, in its child frame [m, rad].
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

Eigen::Matrix3d skew(const Eigen::Vector3d& v);

/// Rotation by |v| about v, and back; the logarithm has a length of at most pi.
Eigen::Matrix3d rotation_exp(const Eigen::Vector3d& v);
Eigen::Vector3d rotation_log(const Eigen::Matrix3d& R);

/// Roll, pitch, yaw about fixed x, y, z, R = Rz(yaw) Ry(pitch) Rx(roll), and back [rad].
Eigen::Vector3d roll_pitch_yaw(const Eigen::Matrix3d& R);
Eigen::Matrix3d rotation_of_rpy(const Eigen::Vector3d& rpy);

/// Angle of a rotation, 0 to pi [rad].
double rotation_angle(const Eigen::Matrix3d& R);

/// The right perturbation of this project: T [Exp(dtheta), dt] = [R Exp(dtheta), t + R dt].
Eigen::Isometry3d moved(const Eigen::Isometry3d& T, const Vector6d& xi);

/// xi with to = moved(from, xi).
Vector6d motion_between(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to);

/// Ad(T): T moved(I, xi) T^-1 = moved(I, Ad(T) xi) to first order. A perturbation xi of A is Ad(B^-1) xi of A
/// B.
Matrix6d adjoint(const Eigen::Isometry3d& T);

/// J_r^-1: log(Exp(v) Exp(d)) = v + J_r^-1(v) d to first order.
Eigen::Matrix3d right_jacobian_inverse(const Eigen::Vector3d& v);

/// The rotation nearest to a 3 x 3 matrix in the Frobenius norm.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& M);

/// Mean translation and chordal mean rotation (Hartley et al. 2013, sec. 5.3).
Eigen::Isometry3d mean_pose(const std::vector<Eigen::Isometry3d>& poses);

}  // namespace flash::calib
