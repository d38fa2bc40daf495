#pragma once
#include <Eigen/Core>

namespace flash::sim {

/// Of the linear shape functions of a triangle or a tetrahedron, a row for each vertex [1/m].
template <int dimension>
Eigen::Matrix<double, dimension + 1, dimension> shape_gradients(
    const Eigen::Matrix<double, dimension, dimension>& inverse_edges) {
  Eigen::Matrix<double, dimension + 1, dimension> gradients;
  gradients.template bottomRows<dimension>() = inverse_edges;
  gradients.row(0) = -inverse_edges.colwise().sum();
  return gradients;
}

}  // namespace flash::sim
