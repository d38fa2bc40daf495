#pragma once
#include <Eigen/Core>
#include <vector>

#include "data/mesh/mesh.h"

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

/// Several ways to move a sheet and the force on it at one keyframe, a column each.
struct SheetShapes {
  /// Rows: x, y and z of one vertex after the other [m].
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> positions;
  Eigen::Matrix3Xd force;  ///< [N]
};

/// One a keyframe; shifts that are empty are zero columns. Empty where all are.
std::vector<SheetShapes> side_by_side(const std::vector<const SheetShifts*>& shifts, int threads = 1);

/// Their sum, each by its size.
void mix(const std::vector<SheetShapes>& shapes, const Eigen::VectorXd& sizes, SheetShifts& sum);

}  // namespace flash::sysid
