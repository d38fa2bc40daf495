#pragma once
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <vector>

#include "data/mesh/mesh.h"

namespace flash::data {

/// How often each edge is run along, from its first vertex to its second.
inline std::map<std::array<int, 2>, int> directed_edges(const TriangleMesh& mesh) {
  std::map<std::array<int, 2>, int> edges;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t)
    for (int k = 0; k < 3; ++k) ++edges[{mesh.triangles(t, k), mesh.triangles(t, (k + 1) % 3)}];
  return edges;
}

/// Rings of edges that have one triangle, each by the mean of its vertices.
inline std::vector<Eigen::Vector3d> openings(const TriangleMesh& mesh) {
  const auto edges = directed_edges(mesh);
  std::map<int, int> next;
  for (const auto& [edge, count] : edges)
    if (!edges.contains({edge[1], edge[0]})) next[edge[0]] = edge[1];
  std::vector<Eigen::Vector3d> middles;
  while (!next.empty()) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int count = 0;
    for (auto at = next.begin(); at != next.end(); ++count) {
      const int to = at->second;
      sum += mesh.vertices.row(at->first).transpose();
      next.erase(at);
      at = next.find(to);
    }
    middles.push_back(sum / count);
  }
  return middles;
}

/// One piece of a sphere with so many holes, whose triangles face the same way.
inline void expect_surface_with_openings(const TriangleMesh& mesh, int holes) {
  std::set<std::array<int, 2>> undirected;
  for (const auto& [edge, count] : directed_edges(mesh)) {
    EXPECT_EQ(count, 1);  // at most two triangles an edge
    undirected.insert({std::min(edge[0], edge[1]), std::max(edge[0], edge[1])});
  }
  // Euler: a sphere has 2, and each hole takes one away.
  EXPECT_EQ(mesh.vertices.rows() - static_cast<long>(undirected.size()) + mesh.triangles.rows(), 2 - holes);
  EXPECT_EQ(openings(mesh).size(), static_cast<std::size_t>(holes));
}

}  // namespace flash::data
