#pragma once
#include <Eigen/Core>
#include <vector>

#include "data/mesh/mesh.h"

namespace flash::sim {

/// Unit vector along the table from a patch of the sheet towards its middle: the diagonal at a corner. `up`:
/// unit, out of the table.
Eigen::Vector3d towards_middle(const data::Points& positions, const std::vector<int>& patch,
                               const Eigen::Vector3d& up);

/// Where two fingers hold a patch that lay `flat` [m]: folded about the line through its centre along
/// `ridge` and standing on the table. A vertex at (a, b) along and across the ridge goes s = min(|b|, apart /
/// 2) to its side, and is held at m + a ridge + sign(b) s across + (max(|b| - s) - (|b| - s)) up. The whole
/// is then tilted by `pitch` [rad] about the axis across the ridge through m. `apart`: how far apart the
/// sides of the fold are [m], 0 for layers that pass through each other.
data::Points pinch_targets(const data::Points& flat, const Eigen::Vector3d& ridge, const Eigen::Vector3d& up,
                           double pitch, double apart = 0);

/// Raises `targets` as a whole along `normal` until none lies below the plane through `point`: fingers do not
/// push the sheet into the table.
void raise_above(const Eigen::Vector3d& point, const Eigen::Vector3d& normal, data::Points& targets);

}  // namespace flash::sim
