#pragma once
#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "calib/calibrate/cell.h"

namespace flash::calib {

/// "flash-cell/1". workspace: a point in the first base; each base carries its standard deviation there.
nlohmann::ordered_json to_json(const Cell& cell, const std::optional<Eigen::Vector3d>& workspace);

}  // namespace flash::calib
