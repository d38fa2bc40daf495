#pragma once
#include <string>

#include "data/mesh/mesh.h"

namespace flash::data {

/// How the cells of a rectangle are cut: all diagonals alike, turned from cell to cell in both directions,
/// turned from row to row, or turned at random with the inner vertices moved too.
enum class DiagonalPattern { one_way, alternating, alternating_by_row, jittered };

struct RectangleMesh {
  double width = 0.4;   ///< along x [m]
  double height = 0.4;  ///< along y [m]
  int cells_x = 40;
  int cells_y = 40;
  DiagonalPattern pattern = DiagonalPattern::alternating;
  double jitter = 0.25;  ///< `jittered`: largest move of an inner vertex along each axis, in cells
  unsigned seed = 1;     ///< `jittered`: the same seed gives the same mesh
};

/// (cells_x + 1) (cells_y + 1) vertices in 0 <= x <= width, 0 <= y <= height, z = 0; x runs fastest. Normals
/// point to +z.
TriangleMesh rectangle(const RectangleMesh& settings);

/// Delaunay triangles over a rectangle: even points on the border, irregular ones within (Bowyer-Watson,
/// quadratic cost: meant for thousands of vertices at most). `cell` is the wanted edge length [m]. Where both
/// sides are at least a cell, no angle is below 15 degrees.
TriangleMesh delaunay_rectangle(double width, double height, double cell, unsigned seed);

/// Disc around the origin in rings of `cell` width [m].
TriangleMesh disc(double radius, double cell);

/// Box from the origin to `size` [m], five tetrahedra a cell, mirrored from cell to cell so that faces match.
TetMesh tet_box(const Eigen::Vector3d& size, const Eigen::Vector3i& cells);

/// "sheet:0.278x0.278:0.01[:pattern]" (pattern one_way, alternating, alternating_by_row, jittered, delaunay)
/// or "disc:0.2:0.01" or "tshirt:0.014", "shorts:0.014" (data/mesh/tshirt.h, shorts.h); the last length is
/// the cell, rounded so that a whole number of cells fits, and at most the shorter side, or the radius.
/// Throws InputError naming `source` and `field`, which is empty where the source is an option.
bool is_mesh_spec(const std::string& text);
TriangleMesh parse_mesh_spec(const std::string& spec, const std::string& source = "mesh",
                             const std::string& field = "sheet");

/// "box:0.1x0.03x0.03:0.01": tet_box of that size with whole cells of about that edge, at most 100,000.
/// Throws InputError likewise.
bool is_tet_mesh_spec(const std::string& text);
TetMesh parse_tet_mesh_spec(const std::string& spec, const std::string& source, const std::string& field);

/// Whether a mesh is made from its name, so that it is no file.
inline bool is_made_on_the_spot(const std::string& mesh) {
  return is_mesh_spec(mesh) || is_tet_mesh_spec(mesh);
}

/// The name used in specs and files.
const char* to_string(DiagonalPattern pattern);

}  // namespace flash::data
