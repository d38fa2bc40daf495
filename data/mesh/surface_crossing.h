#pragma once
#include <optional>
#include <span>
#include <utility>

#include "data/mesh/mesh.h"

namespace flash::data {

/// Whether the segment from a to b passes through the triangle x[0], x[1], x[2]. What only touches does not
/// pass.
bool passes(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d* x);

/// Numbers of two triangles of a mesh, the smaller first.
using TrianglePair = std::pair<int, int>;

/// Two triangles that share no edge and pass through each other by more than rounding: a millionth of the
/// mesh, at most a thousandth of the triangles. Those of the lowest numbers; empty where there are none.
/// `part`: of each vertex; only triangles of one part are compared. Time grows as n log n.
std::optional<TrianglePair> first_crossing(const TriangleMesh& mesh, std::span<const int> part = {});

/// Two triangles that lie on each other: in one plane, to the same rounding, with a common area above a
/// thousandth of the smaller one. Likewise.
std::optional<TrianglePair> first_cover(const TriangleMesh& mesh);

}  // namespace flash::data
