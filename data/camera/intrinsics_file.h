#pragma once
#include <string>

#include "data/camera/camera.h"

namespace flash::data {

/// Intrinsics as people have them: what load_camera_intrinsics reads, Kalibr's camchain, and
///   YAML or JSON with a 3 x 3 matrix (camera_matrix, K, mtx, Intrinsic, intrinsic_matrix) or fx, fy, cx, cy
///   (ppx, ppy), and coefficients (distortion_coefficients, dist_coeffs, Distortion, dist, D, coeffs,
///   distortion: {model, coefficients}) or k1, k2, p1, p2, k3, or
///   .npz with such arrays, as numpy.savez writes it.
/// Capitals and what parts words do not count in names. Files without the size of the pictures have width and
/// height 0: the pictures tell it. Throws InputError, also of a model that is not OpenCV's.
CameraIntrinsics load_intrinsics(const std::string& path);

}  // namespace flash::data
