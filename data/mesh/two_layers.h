#pragma once
#include <Eigen/Core>
#include <functional>

#include "data/mesh/mesh.h"

namespace flash::data {

/// A garment that lies flat, its front up: a back and a front of one outline, on the vertices of a lattice of
/// columns and rows. Where it is sewn both share a vertex, half-way between them.
struct TwoLayers {
  int first_column = 0, last_column = 0, last_row = 0;  ///< rows from 0
  std::function<bool(int column, int row)> has;         ///< whether the layers have the vertex
  std::function<bool(int column, int row)> is_sewn;     ///< of one that they have
  std::function<Eigen::Vector2d(int column, int row, bool front)> place;  ///< [m]
  double apart = 0;  ///< distance of the layers [m]; the back lies at z = 0
};

/// Triangles face outwards. A cell has two where all its corners are there, cut along alternating diagonals.
TriangleMesh two_layers(const TwoLayers& garment);

}  // namespace flash::data
