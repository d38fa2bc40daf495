#pragma once
#include <Eigen/Core>
#include <vector>

#include "data/mesh.h"

namespace flash::sim {

/// A triangle of the rest shape in its own plane.
struct RestTriangle {
  Eigen::Vector3i vertices;
  Eigen::Matrix2d inverse_edges;  ///< inverse of the 2 x 2 matrix of rest edges (x1 - x0, x2 - x0) [1/m]
  double area;                    ///< [m^2]
  bool stiff = false;             ///< inside a clamp: does not bend (plate only)
};

/// What all environments of one mesh share: the rest shape, never a material.
struct Sheet {
  data::TriangleMesh rest;
  std::vector<RestTriangle> triangles;
  Eigen::VectorXd vertex_area;  ///< a third of the area of the adjacent triangles [m^2]
};

/// Throws data::InputError on degenerate or duplicate triangles and on vertices without a triangle.
Sheet make_sheet(const data::TriangleMesh& rest);

}  // namespace flash::sim
