#pragma once
#include "data/mesh/mesh.h"

namespace flash::data {

/// What a closed surface encloses, whose triangles face outwards [m^3]; below 0 where they face inwards. By
/// tetrahedra from its middle, so that it is exact far from the origin too.
double enclosed_volume(const TriangleMesh& mesh);

}  // namespace flash::data
