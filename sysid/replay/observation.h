#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "data/mesh/mesh.h"
#include "sysid/replay/mark.h"

namespace flash::sysid {

/// What was seen at one time.
struct Observation {
  double t = 0;                            ///< [s]
  data::Points points{};                   ///< inside the crop, base frame [m]
  double weight = 1;                       ///< in the mean over keyframes; 0 leaves it out of score and fit
  data::Points contour{};                  ///< of the outline, inside the crop [m]
  data::Points markers{};                  ///< [m]
  std::vector<Mark> marks{};               ///< where on the sheet each of `markers` was put
  std::optional<Eigen::Vector3d> force{};  ///< last gripper on sheet [N]

  /// Whether there is anything to compare with.
  bool seen() const { return count() > 0; }
  /// Number of points, and one for a force.
  Eigen::Index count() const {
    return points.rows() + contour.rows() + markers.rows() + (force.has_value() ? 1 : 0);
  }
};

}  // namespace flash::sysid
