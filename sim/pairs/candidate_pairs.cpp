#include "sim/pairs/candidate_pairs.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>

namespace flash::sim {

namespace {

constexpr double rest_share = 0.9;  ///< of the distance at rest, from which on close features meet

/// What all pairs of a search share.
struct Search {
  const PairSurface& surface;
  std::span<const Bounds> boxes;
  double thickness;
  const std::vector<bool>& carried;
  std::vector<CandidatePair>& pairs;

  Bounds box_of(std::span<const int> vertices) const {
    Bounds box;
    for (const int v : vertices) box.take(boxes[v]);
    return box;
  }

  /// From which distance on the features meet, as find_candidates says.
  double thickness_of(PairKind kind, const std::array<int, 4>& v) const {
    if (surface.body[v[0]] != surface.body[v[3]]) return thickness;
    Vector3<double> x[4];
    for (int k = 0; k < 4; ++k) x[k] = {surface.rest(v[k], 0), surface.rest(v[k], 1), surface.rest(v[k], 2)};
    const double distance = nearest_points(kind, x).distance;
    return distance > thickness ? thickness : rest_share * distance;
  }

  void add(PairKind kind, const std::array<int, 4>& v, double area) const {
    if (carried[v[0]] && carried[v[1]] && carried[v[2]] && carried[v[3]]) return;
    pairs.push_back({kind, v, thickness_of(kind, v), area});
  }

  void vertices_on_face(int owner, int t) const {
    const auto face = surface.triangles.row(t);
    for (const int v : surface.own_vertices[owner])
      if (v >= 0 && v != face[0] && v != face[1] && v != face[2] &&
          near(boxes[v], surface.tree.triangle(t), thickness))
        add(PairKind::vertex_face, {v, face[0], face[1], face[2]}, 0.25 * surface.vertex_area[v]);
  }

  void edges_on_edges(int s, int t) const {
    for (const int e : surface.own_edges[s]) {
      if (e < 0) continue;
      const auto& a = surface.edges[e];
      const Bounds box = box_of(a);
      if (!near(box, surface.tree.triangle(t), thickness)) continue;
      for (const int f : surface.own_edges[t]) {
        if (f < 0) continue;
        const auto& b = surface.edges[f];
        if (a[0] == b[0] || a[0] == b[1] || a[1] == b[0] || a[1] == b[1] || !near(box, box_of(b), thickness))
          continue;
        add(PairKind::edge_edge, {a[0], a[1], b[0], b[1]},
            0.25 * std::numbers::pi * surface.edge_width[e] * surface.edge_width[f]);
      }
    }
  }
};

}  // namespace

void find_candidates(PairSurface& surface, std::span<const Bounds> boxes, double thickness,
                     const std::vector<bool>& carried, std::vector<CandidatePair>& pairs) {
  pairs.clear();
  surface.tree.refit(boxes);
  const Search search{surface, boxes, thickness, carried, pairs};
  surface.tree.for_each_near(thickness, [&](int s, int t) {
    search.vertices_on_face(s, t);
    search.vertices_on_face(t, s);
    search.edges_on_edges(s, t);
  });
}

}  // namespace flash::sim
