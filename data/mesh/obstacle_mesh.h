#pragma once
#include <span>
#include <string>

#include "data/mesh/mesh.h"

namespace flash::data {

/// A rigid surface that bodies meet.
struct ObstacleMesh {
  TriangleMesh mesh;
  /// Whether every edge has two triangles, so that there is an inside. An open one is met on both sides.
  bool closed = false;
  int border_edges = 0;  ///< edges of one triangle
};

/// Reads a surface as load_triangle_mesh does, its coordinates times `scale`. Corners at the same place
/// become one vertex where the surface is open otherwise, as in files that keep each face by itself. Throws
/// InputError, too, where it meets itself in a point alone, where a closed one is inside out, and where a
/// part of one passes through itself, with two triangles.
ObstacleMesh load_obstacle_mesh(const std::string& path, double scale = 1);

/// The same of a mesh at hand, which `source` names.
ObstacleMesh checked_obstacle_mesh(TriangleMesh mesh, const std::string& source);

/// Throws InputError where triangles pass through each other, naming two. `part`: of each vertex; only
/// triangles of one part are compared.
void check_crossings(const TriangleMesh& mesh, const std::string& source, std::span<const int> part = {});

}  // namespace flash::data
