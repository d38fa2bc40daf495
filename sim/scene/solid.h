#pragma once
#include <array>
#include <string>
#include <vector>

#include "data/mesh/mesh.h"
#include "sim/scene/sheet.h"

namespace flash::sim {

/// The edges of a tetrahedron, between its corners, in the order of RestTetrahedron::midsides.
inline constexpr std::array<std::array<int, 2>, 6> tetrahedron_edges = {
    {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};

/// A mesh of one body of tetrahedra. Quadratic ones get vertices in the middle of the edges, behind those of
/// `rest`. Throws data::InputError as data::check_tet_mesh does.
Sheet make_solid(const data::TetMesh& rest, const std::string& name = {},
                 data::ElementOrder order = data::ElementOrder::linear);

/// Whether a body has quadratic elements.
bool is_quadratic(const Sheet& sheet, const Body& body);

/// The vertices of a sheet of one body that its mesh has.
Eigen::Index mesh_vertices(const Sheet& sheet);

/// `positions` of all vertices of a sheet of one body from those of its mesh; in the middle of edges the
/// mean.
data::Points with_midsides(const Sheet& sheet, const data::Points& positions);

/// `vertices` and those in the middle of edges between two of them.
std::vector<int> with_midsides(const Sheet& sheet, std::vector<int> vertices);

/// The first tetrahedron that `positions` turn inside out or flatten; -1: none.
int first_inverted(const Sheet& sheet, const data::Points& positions);

/// Of its rest volume, below which a tetrahedron counts as collapsed.
inline constexpr double collapsed_volume_share = 1e-3;

/// How many tetrahedra of a body have collapsed at `positions`, or are inside out, by their corners.
int count_collapsed(const Sheet& sheet, const Body& body, const data::Points& positions);

}  // namespace flash::sim
