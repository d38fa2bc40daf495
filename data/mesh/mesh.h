#pragma once
#include <Eigen/Core>

namespace flash::data {

using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;  ///< one row a point [m]
using Triangles =
    Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor>;  ///< one row a triangle, counter-clockwise
using Tetrahedra =
    Eigen::Matrix<int, Eigen::Dynamic, 4, Eigen::RowMajor>;  ///< one row a tetrahedron, positive volume

struct TriangleMesh {
  Points vertices;
  Triangles triangles;
};

/// Of tetrahedra: linear with four vertices, quadratic with six more in the middle of the edges.
enum class ElementOrder { linear = 1, quadratic = 2 };

struct TetMesh {
  Points vertices;
  Tetrahedra tetrahedra;
};

}  // namespace flash::data
