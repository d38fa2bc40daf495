#pragma once
#include "calib/geometry/projection.h"
#include "data/camera/camera.h"
#include "python/bindings/arrays.h"

namespace flash::python {

/// Width, height, fx, fy, cx, cy, and 0, 4, 5 or 8 coefficients of distortion.
data::CameraIntrinsics camera_of(const Numbers& numbers);

/// The same numbers of a camera.
std::vector<double> numbers_of(const data::CameraIntrinsics& camera);

/// Of fx fy cx cy k1 k2 p1 p2 k3 (k4 k5 k6), 4 to 12 rows; none where it has no rows.
calib::LensCovariance lens_covariance_of(const Numbers& rows);

}  // namespace flash::python
