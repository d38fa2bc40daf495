#pragma once
#include <Eigen/Core>
#include <vector>

#include "data/mesh/mesh.h"

namespace flash::data {

/// Delaunay triangles of points in the plane, counter-clockwise, by incremental insertion (Bowyer 1981,
/// Watson 1981). Quadratic in the number of points. The points are compared on a lattice of 2^-30 of the
/// longer side of their box, in exact arithmetic, and must differ there; those of an axis-parallel border
/// stay on its line, and points on one circle get one of the possible diagonals.
Triangles delaunay(const std::vector<Eigen::Vector2d>& points);

}  // namespace flash::data
