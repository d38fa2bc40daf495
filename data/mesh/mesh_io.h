#pragma once
#include <cstddef>
#include <string>

#include "data/mesh/mesh.h"

namespace flash::data {

/// What a geometry file holds, of any format; faces of more than three corners are cut into fans.
struct Geometry {
  Points points;
  Triangles triangles;
  Tetrahedra tetrahedra;
};

/// Reads .ply, .obj, .vtk (legacy), .stl, .pcd, .tet or .msh (Gmsh) by the ending of the name. Throws
/// InputError naming the file, and what is wrong: non-finite points with their count and first index, or an
/// index out of range with its face.
Geometry load_geometry(const std::string& path);

/// The triangles of .ply, .obj, .vtk, .stl or .msh. Also throws on no triangles, and names degenerate and
/// duplicate ones. `weld`: vertices in one place become one first, and those of no triangle go.
TriangleMesh load_triangle_mesh(const std::string& path, bool weld = false);

/// The tetrahedra of .vtk, .tet or .msh; negative ones are turned. Also throws as check_tet_mesh does.
/// `weld`: as above.
TetMesh load_tet_mesh(const std::string& path, bool weld = false);

/// The points of .ply, .pcd, .obj or .vtk; faces do not count. May be empty. Points that are not finite, as
/// the pixels of an organised cloud that saw nothing, are left out, whatever the format.
Points load_point_cloud(const std::string& path);

/// Loads likewise, and adds how many points were left out to `left_out`.
Points load_point_cloud(const std::string& path, std::size_t& left_out);

/// A mesh or, where the file has no triangles, a cloud, of which points that are not finite are left out and
/// added to `left_out`. Throws as load_geometry does.
Geometry load_scan(const std::string& path, std::size_t& left_out);

/// What save_triangle_mesh and save_tet_mesh write to `path`, whose ending they read.
std::string format_triangle_mesh(const TriangleMesh& mesh, const std::string& path);
std::string format_tet_mesh(const TetMesh& mesh, const std::string& path);

/// Format by ending: .ply (binary, double), .obj, .vtk (ascii); clouds .ply (binary, float), .pcd. Written
/// atomically.
void save_triangle_mesh(const TriangleMesh& mesh, const std::string& path);
void save_tet_mesh(const TetMesh& mesh, const std::string& path);
void save_point_cloud(const Points& points, const std::string& path);

/// Throws InputError as the loaders do; `source` names the mesh in the message.
void check_triangle_mesh(const TriangleMesh& mesh, const std::string& source);

/// Throws InputError naming the first tetrahedron that is flat, has a negative volume, or overlaps a
/// neighbour, vertices of none, and outer faces that do not fit, as check_fit does.
void check_tet_mesh(const TetMesh& mesh, const std::string& source);

}  // namespace flash::data
