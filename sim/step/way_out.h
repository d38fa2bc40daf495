#pragma once
#include <vector>

#include "sim/step/contact_geometry.h"

namespace flash::sim {

/// The unit direction in which a sheet leaves all obstacles that it starts in by the shortest way, all
/// vertices alike, so that it is not torn; zero where there is none. `inside` is as vertices_inside finds it.
/// Directions tried: out of the faces of boxes, across the axes of cylinders, out of planes.
Eigen::Vector3d common_way_out(const Environment& environment, const std::vector<ObstacleMotion>& motions,
                               const std::vector<std::vector<int>>& inside);

}  // namespace flash::sim
