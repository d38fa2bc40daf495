#include "data/mesh/tet_fit.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "data/files/error.h"
#include "data/files/text.h"
#include "data/mesh/surface_crossing.h"
#include "data/mesh/tet_faces.h"
#include "data/mesh/weld.h"

namespace flash::data {
namespace {

using Face = std::array<int, 3>;

Face sorted(const Eigen::Vector3i& face) {
  Face result = {face[0], face[1], face[2]};
  std::sort(result.begin(), result.end());
  return result;
}

/// The tetrahedron that has an outer face.
Eigen::Index owner_of(const TetMesh& mesh, const Eigen::Vector3i& face) {
  for (Eigen::Index t = 0; t < mesh.tetrahedra.rows(); ++t)
    for (const Eigen::Vector3i& own : faces_of(mesh.tetrahedra.row(t)))
      if (sorted(own) == sorted(face)) return t;
  return -1;
}

/// The tetrahedra that have `faces`.
std::map<Face, Eigen::Index> owners_of(const TetMesh& mesh, const std::set<Face>& faces) {
  std::map<Face, Eigen::Index> owners;
  for (Eigen::Index t = 0; t < mesh.tetrahedra.rows(); ++t)
    for (const Eigen::Vector3i& own : faces_of(mesh.tetrahedra.row(t)))
      if (const Face face = sorted(own); faces.contains(face)) owners.emplace(face, t);
  return owners;
}

/// Whether p lies within the tetrahedron of vertices a, b, c, d, or on it to rounding.
bool within(const Points& x, const std::array<int, 4>& corners, int p) {
  Eigen::Matrix3d edges;
  for (int k = 0; k < 3; ++k) edges.col(k) = x.row(corners[std::size_t(k) + 1]) - x.row(corners[0]);
  const Eigen::Vector3d share = edges.inverse() * (x.row(p) - x.row(corners[0])).transpose();
  return share.allFinite() && share.minCoeff() > -1e-9 && share.sum() < 1 + 1e-9;
}

/// Two faces over the edge a - c and two over b - d, all outer: neighbours that cut the square a b c d along
/// either diagonal, with a thin gap or overlap between them where it is not flat. A single tetrahedron has
/// such faces too, as has one that is cut at points inside it.
std::optional<Misfit> crossed_diagonals(const TetMesh& mesh, const Triangles& outer) {
  std::map<std::array<int, 2>, std::vector<Eigen::Index>> sides;
  std::set<Face> faces;
  for (Eigen::Index f = 0; f < outer.rows(); ++f) {
    faces.insert(sorted(outer.row(f)));
    for (int k = 0; k < 3; ++k) {
      const int a = outer(f, k), b = outer(f, (k + 1) % 3);
      sides[{std::min(a, b), std::max(a, b)}].push_back(f);
    }
  }
  std::map<Face, Eigen::Index> owners;  // made where they are asked for: seldom
  const auto third = [&](Eigen::Index f, const std::array<int, 2>& side) {
    return int(outer.row(f).sum()) - side[0] - side[1];
  };
  for (const auto& [side, own] : sides)
    for (std::size_t i = 0; i < own.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) {
        const int a = side[0], c = side[1];
        const int b = third(own[i], side), d = third(own[j], side);
        if (b == d || !faces.contains(sorted({a, b, d})) || !faces.contains(sorted({c, b, d}))) continue;
        const Eigen::Vector3i first = outer.row(own[i]), second(a, b, d);
        if (owners.empty()) owners = owners_of(mesh, faces);
        const Eigen::Index owner = owners.at(sorted(first)), other = owners.at(sorted(second));
        if (owner == other) continue;
        const auto all_within = [&](Eigen::Index t) {
          return std::all_of(mesh.tetrahedra.row(t).begin(), mesh.tetrahedra.row(t).end(), [&](int p) {
            return within(mesh.vertices, {a, b, c, d}, p);
          });
        };
        if (all_within(owner) && all_within(other)) continue;
        return Misfit{Misfit::Kind::apart, first, second};
      }
  return {};
}

bool in_same_places(const Points& x, const Eigen::Vector3i& first, const Eigen::Vector3i& second) {
  return std::all_of(first.begin(), first.end(), [&](int a) {
    return std::any_of(second.begin(), second.end(), [&](int b) { return x.row(a) == x.row(b); });
  });
}

std::string list_of(const Eigen::Vector3i& face) {
  return std::to_string(face[0]) + ", " + std::to_string(face[1]) + ", " + std::to_string(face[2]);
}

}  // namespace

std::optional<Misfit> first_misfit(const TetMesh& mesh) {
  const TriangleMesh outer{mesh.vertices, outer_faces(mesh.tetrahedra)};
  const auto misfit = [&](Misfit::Kind kind, const TrianglePair& pair) {
    return Misfit{kind, outer.triangles.row(pair.first), outer.triangles.row(pair.second)};
  };
  if (const auto found = first_cover(outer)) {
    const Misfit both = misfit(Misfit::Kind::apart, *found);
    const bool doubled = in_same_places(mesh.vertices, both.first, both.second);
    return Misfit{doubled ? Misfit::Kind::doubled : Misfit::Kind::apart, both.first, both.second};
  }
  if (const auto found = crossed_diagonals(mesh, outer.triangles)) return found;
  if (const auto found = first_crossing(outer)) return misfit(Misfit::Kind::crossing, *found);
  return {};
}

void check_fit(const TetMesh& mesh, const std::string& source) {
  const std::optional<Misfit> misfit = first_misfit(mesh);
  if (!misfit) return;
  const Eigen::Index first = owner_of(mesh, misfit->first), second = owner_of(mesh, misfit->second);
  const std::string field = "tetrahedron " + std::to_string(first);
  const std::string own = "its face of vertices " + list_of(misfit->first);
  const std::string other =
      "the face of vertices " + list_of(misfit->second) + " of tetrahedron " + std::to_string(second);
  if (misfit->kind == Misfit::Kind::doubled)
    throw input_error(
        source, field,
        own + " stands in the place of " + other +
            " and is not joined to it: " + format_count(doubled_vertices(mesh.vertices)) + " of its " +
            format_count(std::size_t(mesh.vertices.rows())) +
            " vertices stand where another does; flash-sim mesh --weld joins them, and bodies that "
            "only touch go into files of their own");
  if (misfit->kind == Misfit::Kind::crossing)
    throw input_error(
        source, field,
        own + " passes through " + other +
            "; expected tetrahedra that do not overlap, bodies of their own in files of their own");
  throw input_error(source, field,
                    own + " lies against " + other +
                        " and is not the same; expected neighbours that share whole faces, cut along one "
                        "diagonal, and bodies that only touch in files of their own");
}

}  // namespace flash::data
