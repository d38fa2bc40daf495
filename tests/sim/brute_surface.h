#pragma once
#include <vector>

#include "data/mesh/mesh.h"

// What a surface of triangles is, asked of all triangles one by one: what fast queries are held against.
namespace flash::sim {

/// Distance of a point to the nearest of all triangles [m].
double brute_distance(const data::TriangleMesh& mesh, const Eigen::Vector3d& point);

/// How often the surface winds about a point: 1 inside, 0 outside of a closed one (van Oosterom and Strackee
/// 1983).
double brute_winding(const data::TriangleMesh& mesh, const Eigen::Vector3d& point);

/// Where a straight way goes through a triangle: the share of the way before it, and the triangle's normal.
struct BruteCrossing {
  double share;
  Eigen::Vector3d normal;
};

/// All of them, in order.
std::vector<BruteCrossing> brute_crossings(const data::TriangleMesh& mesh, const Eigen::Vector3d& from,
                                           const Eigen::Vector3d& to);

}  // namespace flash::sim
