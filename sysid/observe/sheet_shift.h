#pragma once
#include <Eigen/Core>
#include <vector>

#include "data/mesh.h"

namespace flash::sysid {

/// By what a sheet and the force on it are moved at one keyframe.
struct SheetShift {
  data::Points positions;                           ///< of each vertex [m]
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< [N]
};

/// One a keyframe.
using SheetShifts = std::vector<SheetShift>;

/// a += share b; an empty a is zero.
void add(SheetShifts& a, double share, const SheetShifts& b);

}  // namespace flash::sysid
