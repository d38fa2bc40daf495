#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "data/mesh/mesh.h"
#include "data/scene/scene.h"

namespace flash::data {

/// What the objects of a scene collide with: its obstacles, then the boxes of end effectors that collide.
std::vector<SceneObstacle> colliding(const Scene& scene);

/// The surface of a box about the origin with edges of `size` [m]: 8 vertices, 12 triangles.
TriangleMesh box_surface(const Eigen::Vector3d& size);

/// The surface of an obstacle in the frame in which it stands: that of its trajectory, or the base frame
/// where it has none. What has no end is cut off: a plane is a square, a cylinder as long, as reaches past
/// the box `about` [m]. Round ones have 48 flat sides, whose corners lie on the obstacle.
TriangleMesh obstacle_surface(const SceneObstacle& obstacle, const Eigen::AlignedBox3d& about);

/// Surfaces of a scene's obstacles, and of end effectors that collide, as they stand at `time` [s]: to draw.
/// Cut off likewise.
std::vector<TriangleMesh> obstacle_surfaces(const Scene& scene, double time,
                                            const Eigen::AlignedBox3d& about);

}  // namespace flash::data
