#pragma once
#include <Eigen/Core>
#include <vector>

#include "data/mesh.h"

namespace flash::data {

/// Delaunay triangles of points in the plane, counter-clockwise, by incremental insertion (Bowyer 1981,
/// Watson 1981). Quadratic in the number of points. Points on an axis-parallel border may lie on one line;
/// the points must differ.
Triangles delaunay(const std::vector<Eigen::Vector2d>& points);

}  // namespace flash::data
