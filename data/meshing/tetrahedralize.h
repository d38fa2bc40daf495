#pragma once
#include <string>

#include "data/mesh/mesh.h"

namespace flash::data {

/// A solid in tetrahedra, and how good they are.
struct FilledSolid {
  TetMesh mesh;
  double volume = 0, surface_volume = 0;       ///< of the tetrahedra and within the given surface [m^3]
  double least_angle = 0, largest_angle = 0;   ///< between two faces of a tetrahedron [deg]
  double shortest_edge = 0, longest_edge = 0;  ///< [m]
};

/// Fills a closed surface with tetrahedra of about the edge length `edge` [m] by the program `tetgen` (Si
/// 2015), which runs apart, in a folder of its own that goes again. The surface keeps its shape; its
/// triangles are cut. Throws InputError naming `source` where the surface is not closed (load_obstacle_mesh
/// says what is asked), where tetgen is not installed, and where it refuses, with its reason.
FilledSolid filled_solid(const TriangleMesh& surface, double edge, const std::string& source);

}  // namespace flash::data
