#pragma once
#include <string>

#include "data/mesh.h"
#include "sim/scene/sheet.h"

namespace flash::sim {

/// A mesh of one body of tetrahedra. Throws data::InputError as data::check_tet_mesh does.
Sheet make_solid(const data::TetMesh& rest, const std::string& name = {});

/// Poisson's ratio from which linear tetrahedra are too stiff by far: they lock, as each keeps its volume by
/// itself (docs/theory.md).
inline constexpr double locking_poissons_ratio = 0.4;

/// The first tetrahedron that `positions` turn inside out or flatten; -1: none.
int first_inverted(const Sheet& sheet, const data::Points& positions);

}  // namespace flash::sim
