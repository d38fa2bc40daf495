#pragma once
#include <array>

#include "data/mesh/mesh.h"

namespace flash::data {

/// The four faces of a tetrahedron of positive volume, counter-clockwise seen from outside.
std::array<Eigen::Vector3i, 4> faces_of(const Eigen::Vector4i& tetrahedron);

/// The faces that one tetrahedron alone has: the surface, counter-clockwise seen from outside.
Triangles outer_faces(const Tetrahedra& tetrahedra);

/// A pair of tetrahedra that lie on the same side of a face that they share, so that they overlap; both -1
/// where there is none.
struct Overlap {
  Eigen::Index first = -1, second = -1;
  Eigen::Vector3i face = Eigen::Vector3i::Constant(-1);
};
Overlap first_overlap(const Tetrahedra& tetrahedra);

}  // namespace flash::data
