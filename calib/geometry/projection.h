#pragma once
#include <Eigen/Core>

#include "data/camera/camera.h"

namespace flash::calib {

/// fx fy cx cy, then k1 k2 p1 p2 k3 k4 k5 k6: the order of intrinsics as unknowns.
constexpr int kIntrinsics = 12;
using IntrinsicsVector = Eigen::Matrix<double, kIntrinsics, 1>;
using LensCovariance = Eigen::Matrix<double, kIntrinsics, kIntrinsics>;

IntrinsicsVector to_vector(const data::CameraIntrinsics& camera);

/// Size, and the model wherever its coefficients suffice, are those of `camera`.
data::CameraIntrinsics with_vector(const data::CameraIntrinsics& camera, const IntrinsicsVector& intrinsics);

/// Pixel of a point in the camera frame (z > 0) by OpenCV's formula, and its derivatives where asked for.
Eigen::Vector2d project(const IntrinsicsVector& intrinsics, const Eigen::Vector3d& point,
                        Eigen::Matrix<double, 2, 3>* d_point = nullptr,
                        Eigen::Matrix<double, 2, kIntrinsics>* d_intrinsics = nullptr);

}  // namespace flash::calib
