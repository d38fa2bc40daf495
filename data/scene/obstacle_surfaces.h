#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "data/mesh/mesh.h"
#include "data/scene/scene.h"

namespace flash::data {

/// Surfaces of a scene's obstacles, and of end effectors that collide, as they stand at `time` [s]: to draw.
/// What has no end is cut off: a plane is a square, a cylinder as long, as reaches past the box `about` [m].
std::vector<TriangleMesh> obstacle_surfaces(const Scene& scene, double time,
                                            const Eigen::AlignedBox3d& about);

}  // namespace flash::data
