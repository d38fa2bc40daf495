#pragma once
#include <Eigen/Core>
#include <array>
#include <functional>
#include <vector>

#include "sim/scene/sheet.h"

namespace flash::sim {

/// A tetrahedron with its place in the system matrix. Its vertices ascend, so that its blocks (1, 0), (2, 0),
/// (2, 1), (3, 0), (3, 1) and (3, 2) are stored as they are.
struct SolidElement {
  std::array<int, 4> vertices;
  std::array<int, 6> slots;               ///< of these blocks in a BlockPattern
  Eigen::Matrix<double, 4, 3> gradients;  ///< rows w_i of F = sum_i x_i w_i^T [1/m]
  double volume;                          ///< at rest [m^3]

  Eigen::Matrix3d deformation(const data::Points& positions) const;
};

/// The pairs (row, column) of the blocks of an element, in the order of its slots.
inline constexpr int solid_pairs[6][2] = {{1, 0}, {2, 0}, {2, 1}, {3, 0}, {3, 1}, {3, 2}};

/// The elements of all solid bodies, in the order of the sheet's tetrahedra. slot(row, column) is the place
/// of a block, row > column.
std::vector<SolidElement> solid_elements(const Sheet& sheet, const std::function<int(int, int)>& slot);

}  // namespace flash::sim
