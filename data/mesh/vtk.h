#pragma once
#include <string>
#include <string_view>

#include "data/mesh/mesh_io.h"

namespace flash::data {

/// Legacy VTK, ascii or binary (big endian): POLYDATA with POLYGONS, or UNSTRUCTURED_GRID with triangles,
/// quads, polygons and tetrahedra; other cells and all attributes are skipped. Throws InputError naming
/// `source`.
Geometry parse_vtk(std::string_view bytes, const std::string& source);

/// Legacy ascii.
std::string format_vtk(const TriangleMesh& mesh);
std::string format_vtk(const TetMesh& mesh);

}  // namespace flash::data
