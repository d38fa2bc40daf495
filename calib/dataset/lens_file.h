#pragma once
#include <optional>
#include <string>

#include "calib/geometry/projection.h"

namespace flash::calib {

/// camera_info YAML with one field more, `intrinsics_covariance`: rows of fx fy cx cy k1 k2 p1 p2 k3 (k4 k5
/// k6).
void save_lens(const data::CameraIntrinsics& camera, const LensCovariance& covariance,
               const std::string& path);

/// That field of any file of intrinsics; zero for unknowns it does not speak of. None where there is none.
/// Throws data::InputError where it is not a covariance.
std::optional<LensCovariance> load_lens_covariance(const std::string& path);

}  // namespace flash::calib
