#pragma once
#include <string>

#include "data/camera.h"

namespace flash::calib {

/// Intrinsics as people have them: what data::load_camera_intrinsics reads, Kalibr's camchain, and
///   YAML or JSON with a 3 x 3 matrix (camera_matrix, cameraMatrix, K, mtx, intrinsic_matrix) or fx, fy, cx,
///   cy (ppx, ppy), and coefficients (distortion_coefficients, distCoeffs, dist_coeffs, dist, D, coeffs), or
///   .npz with such arrays, as numpy.savez writes it.
/// Files without the size of the pictures have width and height 0: the pictures tell it. Throws
/// data::InputError.
data::CameraIntrinsics load_intrinsics(const std::string& path);

}  // namespace flash::calib
