#pragma once
#include <nlohmann/json_fwd.hpp>

#include "calib/calibrate/extrinsics.h"

namespace flash::calib {

/// Everything that formats.md asks for: transform, covariance, noise, residuals, comparison, views,
/// observability, findings, scale, warnings, provenance.
nlohmann::ordered_json to_json(const Calibration& calibration, const ExtrinsicsInputs& inputs, int exit_code);

/// {"estimate", "sd", "solved", "prior_sd", "wanted", "wanted_sd"}
nlohmann::ordered_json to_json(const TargetSize& size);

/// Three numbers, along the axes [mm] or about them [deg]; null: not told.
nlohmann::ordered_json to_json(const ToldDeviations& deviations, bool rotation);

/// {"parent", "child", "translation": [x, y, z], "rotation_xyzw": [...]}
nlohmann::ordered_json to_json(const NamedTransform& transform);

}  // namespace flash::calib
