#include "data/mesh/tshirt.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "data/files/error.h"
#include "data/mesh/procedural_mesh.h"

namespace flash::data {
namespace {

/// How often each edge is run along, from its first vertex to its second.
std::map<std::array<int, 2>, int> directed_edges(const TriangleMesh& mesh) {
  std::map<std::array<int, 2>, int> edges;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t)
    for (int k = 0; k < 3; ++k) ++edges[{mesh.triangles(t, k), mesh.triangles(t, (k + 1) % 3)}];
  return edges;
}

/// Rings of edges that have one triangle, each by the mean of its vertices.
std::vector<Eigen::Vector3d> openings(const TriangleMesh& mesh) {
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

TEST(Tshirt, IsASurfaceWithFourOpenings) {
  for (const double cell : {0.014, 0.03, 0.0425}) {
    const TriangleMesh mesh = tshirt({.cell = cell});
    const auto edges = directed_edges(mesh);
    std::set<std::array<int, 2>> undirected;
    for (const auto& [edge, count] : edges) {
      EXPECT_EQ(count, 1) << cell;  // at most two triangles an edge, which face the same way
      undirected.insert({std::min(edge[0], edge[1]), std::max(edge[0], edge[1])});
    }
    // Euler: a sphere has 2, and each hole takes one away.
    EXPECT_EQ(mesh.vertices.rows() - static_cast<long>(undirected.size()) + mesh.triangles.rows(), 2 - 4)
        << cell;
    EXPECT_EQ(openings(mesh).size(), 4u) << cell;
  }
}

TEST(Tshirt, OpensAtTheHemTheCuffsAndTheNeck) {
  const TshirtMesh settings;
  const std::vector<Eigen::Vector3d> middles = openings(tshirt(settings));
  const double cuff = 0.5 * settings.width + settings.sleeve;
  const auto has = [&](double x, double low, double high) {
    return std::any_of(middles.begin(), middles.end(), [&](const Eigen::Vector3d& middle) {
      return std::abs(middle.x() - x) < 1e-9 && low < middle.y() && middle.y() < high;
    });
  };
  EXPECT_TRUE(has(0, -1e-9, 1e-9));
  EXPECT_TRUE(has(0, settings.length - settings.neck_depth, settings.length));
  for (const double x : {-cuff, cuff}) EXPECT_TRUE(has(x, 0.3, settings.length));
}

TEST(Tshirt, LayersFaceOutwardsAndMeetAtSeams) {
  const TshirtMesh settings;
  const TriangleMesh mesh = tshirt(settings);
  EXPECT_NEAR(mesh.vertices.rows(), 4000, 250);
  double up = 0, down = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    const Eigen::Vector3d a = mesh.vertices.row(mesh.triangles(t, 0)),
                          b = mesh.vertices.row(mesh.triangles(t, 1)),
                          c = mesh.vertices.row(mesh.triangles(t, 2)), normal = (b - a).cross(c - a);
    const double height = (a + b + c).z() / 3;
    EXPECT_EQ(normal.z() > 0, height > 0.5 * settings.apart) << t;
    (normal.z() > 0 ? up : down) += std::abs(normal.z()) / 2;
  }
  // The neck of the front is lower by two thirds of its depth: two thirds of a parabola's box, to cells of
  // its width.
  const double neck = 2.0 / 3 * settings.neck * 2 / 3 * settings.neck_depth;
  EXPECT_NEAR(down - up, neck, 0.1 * neck);
}

TEST(Tshirt, IsMadeFromItsName) {
  EXPECT_EQ(parse_mesh_spec("tshirt:0.02").vertices, tshirt({.cell = 0.02}).vertices);
  for (const char* spec : {"tshirt:0.1", "tshirt:", "tshirt:0.02:1", "tshirt:1e-6"})
    EXPECT_THROW(parse_mesh_spec(spec), InputError) << spec;
  EXPECT_THROW(tshirt({.cell = 0.2}), InputError);
}

}  // namespace
}  // namespace flash::data
