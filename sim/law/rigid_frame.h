#pragma once
#include <Eigen/Geometry>

#include "sim/law/vector3.h"

namespace flash::sim {

inline Vector3<double> vector3(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// The frame that stands at a pose, base_from_frame.
inline Frame<double> frame_of(const Eigen::Isometry3d& pose) {
  return {vector3(pose.linear().col(0)), vector3(pose.linear().col(1)), vector3(pose.linear().col(2)),
          vector3(pose.translation())};
}

}  // namespace flash::sim
