#include "data/mesh/tet_faces.h"

#include <algorithm>
#include <map>
#include <vector>

namespace flash::data {
namespace {

using Face = std::array<int, 3>;

/// The face with its least vertex first, in the same direction.
Face turned_to_least(const Eigen::Vector3i& face) {
  Face turned = {face[0], face[1], face[2]};
  std::rotate(turned.begin(), std::min_element(turned.begin(), turned.end()), turned.end());
  return turned;
}

}  // namespace

std::array<Eigen::Vector3i, 4> faces_of(const Eigen::Vector4i& t) {
  return {Eigen::Vector3i(t[1], t[2], t[3]), Eigen::Vector3i(t[0], t[3], t[2]),
          Eigen::Vector3i(t[0], t[1], t[3]), Eigen::Vector3i(t[0], t[2], t[1])};
}

Triangles outer_faces(const Tetrahedra& tetrahedra) {
  std::map<Face, Eigen::Index> seen;
  for (Eigen::Index t = 0; t < tetrahedra.rows(); ++t)
    for (const Eigen::Vector3i& face : faces_of(tetrahedra.row(t))) seen.emplace(turned_to_least(face), t);
  std::vector<Eigen::Vector3i> outer;
  for (Eigen::Index t = 0; t < tetrahedra.rows(); ++t)
    for (const Eigen::Vector3i& face : faces_of(tetrahedra.row(t)))
      if (seen.count(turned_to_least({face[0], face[2], face[1]})) == 0) outer.push_back(face);
  Triangles triangles(static_cast<Eigen::Index>(outer.size()), 3);
  for (std::size_t k = 0; k < outer.size(); ++k)
    triangles.row(static_cast<Eigen::Index>(k)) = outer[k].transpose();
  return triangles;
}

Overlap first_overlap(const Tetrahedra& tetrahedra) {
  std::map<Face, Eigen::Index> seen;
  for (Eigen::Index t = 0; t < tetrahedra.rows(); ++t)
    for (const Eigen::Vector3i& face : faces_of(tetrahedra.row(t)))
      if (const auto [other, fresh] = seen.emplace(turned_to_least(face), t); !fresh)
        return {other->second, t, face};
  return {};
}

}  // namespace flash::data
