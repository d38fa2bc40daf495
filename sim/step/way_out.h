#pragma once
#include <vector>

#include "sim/step/contact_geometry.h"

namespace flash::sim {

/// Which vertices stand inside each obstacle at the start of a step: one list an obstacle, ascending.
std::vector<std::vector<int>> vertices_inside(const Environment& environment,
                                              const std::vector<ObstacleMotion>& motions);

/// The unit direction in which a sheet leaves all obstacles that it starts in by the shortest way, all
/// vertices alike, so that it is not torn; zero where there is none. Directions tried: out of the faces of
/// boxes, across the axes of cylinders, out of planes.
Eigen::Vector3d common_way_out(const Environment& environment, const std::vector<ObstacleMotion>& motions,
                               const std::vector<std::vector<int>>& inside);

}  // namespace flash::sim
