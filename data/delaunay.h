#pragma once
#include <Eigen/Core>
#include <vector>

#include "data/mesh.h"

namespace flash::data {

/// Delaunay triangles of points in the plane, counter-clockwise, by incremental insertion (Bowyer 1981,
/// Watson 1981). Quadratic in the number of points. Triangles flatter than 1e-6 of their longest edge
/// squared, as arise between points on a straight border, are left out.
Triangles delaunay(const std::vector<Eigen::Vector2d>& points);

}  // namespace flash::data
