#pragma once
#include "data/mesh/mesh.h"
#include "sim/law/surface_mesh.h"
#include "sim/scene/environment.h"

namespace flash::sim {

/// Depth of a point in an obstacle of the environment as it stands at `time`, negative outside: from the
/// shapes' definitions alone [m].
double depth_in(const Environment& environment, const Obstacle& obstacle, const Eigen::Vector3d& point,
                double time);

/// The triangles of a surface, each with corners of its own.
data::TriangleMesh triangles_of(const SurfaceMesh& surface);

}  // namespace flash::sim
