#pragma once
#include <Eigen/Core>
#include <functional>
#include <vector>

#include "sim/scene/sheet.h"

namespace flash::sim {

/// A place in a tetrahedron at which its strain is taken.
struct QuadraturePoint {
  static constexpr int most_vertices = 10;
  /// Rows w_i, one a vertex of the element, of F = sum_i x_i w_i^T [1/m].
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::ColMajor, most_vertices, 3> gradients;
  double volume;  ///< at rest, that it stands for [m^3]
};

/// A tetrahedron with its place in the system matrix. Its vertices ascend, so that its blocks are stored as
/// they are. A linear one has four vertices and one strain. A quadratic one has ten, and four points with
/// strains of their own.
struct SolidElement {
  std::vector<int> vertices;
  std::vector<int> slots;  ///< of the blocks (1, 0), (2, 0), (2, 1), (3, 0), ... in a BlockPattern
  std::vector<QuadraturePoint> points;
  int first_point;  ///< number of the first among the points of all elements

  /// Deformation gradient at one of its points.
  Eigen::Matrix3d deformation(const QuadraturePoint& point, const data::Points& positions) const;
};

/// The elements of all solid bodies, in the order of the sheet's tetrahedra. slot(row, column) is the place
/// of a block, row > column.
std::vector<SolidElement> solid_elements(const Sheet& sheet, const std::function<int(int, int)>& slot);

}  // namespace flash::sim
