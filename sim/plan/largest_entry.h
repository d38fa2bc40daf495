#pragma once
#include <span>

#include "sim/plan/hinge_bending.h"
#include "sim/scene/sheet.h"

namespace flash::sim {

// The largest entry on the diagonal of a body's stiffness at rest, for a modulus of one: by how much, at
// most, the rounding of a vertex's position changes its force.

/// Of a membrane with E t = 1, for shape functions N: of a vertex's triangles, sum A |grad N|^2 [1]. Of a
/// solid with E = 1: of its tetrahedra, sum of the integrals of |grad N|^2 [m].
double largest_membrane_entry(const Sheet& sheet, const Body& body);

/// Of hinges with D = 1, roughly [1/m^2]: an edge of length l between areas A_0 and A_1 is taken to turn with
/// each of its four vertices by l / (2 A_0) + l / (2 A_1) a metre. `hinges`: of the body.
double largest_hinge_entry(const Sheet& sheet, const Body& body, std::span<const Hinge> hinges);

}  // namespace flash::sim
