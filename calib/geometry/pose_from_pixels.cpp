#include "calib/geometry/pose_from_pixels.h"

#include <Eigen/Cholesky>

#include "calib/geometry/pose.h"
#include "calib/geometry/projection.h"

namespace flash::calib {

Eigen::Isometry3d fitted_pose(const data::CameraIntrinsics& camera, const Eigen::Matrix3Xd& points,
                              const Eigen::Matrix2Xd& pixels, Eigen::Isometry3d T_camera_target) {
  const IntrinsicsVector intrinsics = to_vector(camera);
  for (int iteration = 0; iteration < 10; ++iteration) {
    Matrix6d H = Matrix6d::Zero();
    Vector6d g = Vector6d::Zero();
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      Eigen::Matrix<double, 2, 3> d_q;
      const Eigen::Vector2d r = project(intrinsics, T_camera_target * points.col(i), &d_q) - pixels.col(i);
      Eigen::Matrix<double, 2, 6> J;
      J << d_q * T_camera_target.linear(), -d_q * T_camera_target.linear() * skew(points.col(i));
      H += J.transpose() * J;
      g += J.transpose() * r;
    }
    T_camera_target = moved(T_camera_target, -H.ldlt().solve(g));
  }
  return T_camera_target;
}

}  // namespace flash::calib
