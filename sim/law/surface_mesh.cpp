#include "sim/law/surface_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

namespace flash::sim {
namespace {

using V = Vector3<double>;

constexpr int leaf_size = 4;

V least(const V& a, const V& b) { return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)}; }
V most(const V& a, const V& b) { return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)}; }

/// The box about some of the triangles.
SurfaceNode box_about(const SurfaceMesh& mesh, int first, int count) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  SurfaceNode node{{infinite, infinite, infinite}, {-infinite, -infinite, -infinite}, first, count};
  for (int k = first; k < first + count; ++k)
    for (const V& corner : mesh.triangles[mesh.order[k]].corners) {
      node.low = least(node.low, corner);
      node.high = most(node.high, corner);
    }
  return node;
}

/// Halves the triangles of a node by their middles, along the axis in which these differ most.
void divide(SurfaceMesh& mesh, int number) {
  const SurfaceNode node = mesh.nodes[number];
  if (node.count <= leaf_size) return;
  const auto middle = [&](int triangle) {
    const SurfaceTriangle& t = mesh.triangles[triangle];
    return t.corners[0] + t.corners[1] + t.corners[2];
  };
  V low = middle(mesh.order[node.first]), high = low;
  for (int k = node.first; k < node.first + node.count; ++k) {
    low = least(low, middle(mesh.order[k]));
    high = most(high, middle(mesh.order[k]));
  }
  const V size = high - low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const int half = node.count / 2;
  const auto begin = mesh.order.begin() + node.first;
  std::sort(begin, begin + node.count, [&](int a, int b) {
    const double at_a = middle(a)[axis], at_b = middle(b)[axis];
    return at_a != at_b ? at_a < at_b : a < b;
  });
  const int children = static_cast<int>(mesh.nodes.size());
  mesh.nodes.push_back(box_about(mesh, node.first, half));
  mesh.nodes.push_back(box_about(mesh, node.first + half, node.count - half));
  mesh.nodes[number].first = children;
  mesh.nodes[number].count = 0;
  divide(mesh, children);
  divide(mesh, children + 1);
}

/// Squared distance of a point from the box of a node.
double squared_distance(const SurfaceNode& node, const V& point) {
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double out = std::max({node.low[axis] - point[axis], point[axis] - node.high[axis], 0.0});
    sum += out * out;
  }
  return sum;
}

/// Whether a way may meet the box of a node; `inverse`: one over its components.
bool may_meet(const SurfaceNode& node, const V& from, const V& inverse) {
  constexpr double room = 1e-9;  // [m]
  double enters = -1e-9, leaves = 1 + 1e-9;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = node.low[axis] - room - from[axis], high = node.high[axis] + room - from[axis];
    if (std::isinf(inverse[axis])) {
      if (low > 0 || high < 0) return false;
      continue;
    }
    const double a = low * inverse[axis], b = high * inverse[axis];
    enters = std::max(enters, std::min(a, b));
    leaves = std::min(leaves, std::max(a, b));
  }
  return enters <= leaves;
}

/// Calls `visit` with each triangle of the nodes that `enters` lets in.
template <typename Enters, typename Visit>
void walk(const SurfaceMesh& mesh, const Enters& enters, const Visit& visit) {
  std::array<int, 64> waiting{};
  int count = 0;
  waiting[count++] = 0;
  while (count > 0) {
    const SurfaceNode& node = mesh.nodes[waiting[--count]];
    if (!enters(node)) continue;
    if (node.count == 0) {
      waiting[count++] = node.first + 1;
      waiting[count++] = node.first;
    }
    for (int k = 0; k < node.count; ++k) visit(mesh.order[node.first + k]);
  }
}

/// A way as the axis along which everything is seen, so that it is a point (Woop, Benthin and Wald 2013). A
/// corner that it comes close to is seen at one place by all its triangles: no way passes between them.
struct Sight {
  V from;
  int x, y, z;  ///< axes; the way is steepest along the last
  double slope_x, slope_y;

  Sight(const V& start, const V& way) : from(start) {
    const V size{std::abs(way.x), std::abs(way.y), std::abs(way.z)};
    z = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    x = (z + 1) % 3;
    y = (z + 2) % 3;
    slope_x = way[x] / way[z];
    slope_y = way[y] / way[z];
  }

  std::array<double, 2> seen(const V& corner) const {
    const V out = corner - from;
    return {out[x] - slope_x * out[z], out[y] - slope_y * out[z]};
  }

  /// Whether the way, as a line, meets a triangle, its border taken in.
  bool meets(const SurfaceTriangle& t) const {
    const std::array<double, 2> corners[3] = {seen(t.corners[0]), seen(t.corners[1]), seen(t.corners[2])};
    bool left = true, right = true;
    for (int k = 0; k < 3; ++k) {
      const auto &a = corners[k], &b = corners[(k + 1) % 3];
      const double area = a[0] * b[1] - a[1] * b[0];
      left = left && area >= 0;
      right = right && area <= 0;
    }
    return left || right;
  }
};

/// Numbers the parts of a surface: triangles that hang together by vertices, which no two parts share.
void number_parts(SurfaceMesh& mesh) {
  std::vector<int> root(mesh.vertex_normals.size());
  std::iota(root.begin(), root.end(), 0);
  const auto root_of = [&](int vertex) {
    while (root[vertex] != vertex) vertex = root[vertex] = root[root[vertex]];
    return vertex;
  };
  for (const SurfaceTriangle& t : mesh.triangles)
    for (int k = 1; k < 3; ++k) {
      const int a = root_of(t.vertices[0]), b = root_of(t.vertices[k]);
      root[std::max(a, b)] = std::min(a, b);
    }
  for (SurfaceTriangle& t : mesh.triangles) t.part = root_of(t.vertices[0]);
}

SurfacePlace placed(int triangle, SurfaceFeature feature, int number, const V& on, const V& point) {
  return {triangle, feature, number, on, norm(point - on)};
}

/// The point of an edge, or one of its ends, that is nearest.
SurfacePlace nearest_on_edge(const SurfaceTriangle& t, int triangle, int edge, const V& point) {
  const int next = (edge + 1) % 3;
  const V along = t.corners[next] - t.corners[edge];
  const double share = dot(point - t.corners[edge], along), length = dot(along, along);
  if (share <= 0) return placed(triangle, SurfaceFeature::corner, edge, t.corners[edge], point);
  if (share >= length) return placed(triangle, SurfaceFeature::corner, next, t.corners[next], point);
  return placed(triangle, SurfaceFeature::edge, edge, t.corners[edge] + (share / length) * along, point);
}

}  // namespace

SurfaceMesh make_surface_mesh(const data::ObstacleMesh& source) {
  SurfaceMesh mesh;
  mesh.closed = source.closed;
  const data::TriangleMesh& from = source.mesh;
  mesh.vertex_normals.assign(static_cast<std::size_t>(from.vertices.rows()), {});
  mesh.border_vertices.assign(mesh.vertex_normals.size(), false);
  struct Edge {
    V normal{};
    int triangles = 0;
  };
  std::map<std::array<int, 2>, Edge> edges;
  const auto edge_of = [](const SurfaceTriangle& t, int k) {
    const int a = t.vertices[k], b = t.vertices[(k + 1) % 3];
    return std::array{std::min(a, b), std::max(a, b)};
  };
  for (Eigen::Index row = 0; row < from.triangles.rows(); ++row) {
    SurfaceTriangle t{};
    for (int k = 0; k < 3; ++k) {
      t.vertices[k] = from.triangles(row, k);
      const auto place = from.vertices.row(t.vertices[k]);
      t.corners[k] = {place[0], place[1], place[2]};
    }
    const V across = cross(t.corners[1] - t.corners[0], t.corners[2] - t.corners[0]);
    t.normal = (1 / norm(across)) * across;
    for (int k = 0; k < 3; ++k) {
      const V a = t.corners[(k + 1) % 3] - t.corners[k], b = t.corners[(k + 2) % 3] - t.corners[k];
      V& of_vertex = mesh.vertex_normals[t.vertices[k]];
      of_vertex = of_vertex + std::atan2(norm(cross(a, b)), dot(a, b)) * t.normal;
      Edge& edge = edges[edge_of(t, k)];
      edge.normal = edge.normal + t.normal;
      ++edge.triangles;
    }
    mesh.triangles.push_back(t);
  }
  for (SurfaceTriangle& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      const Edge& edge = edges.at(edge_of(t, k));
      t.edge_normals[k] = edge.normal;
      t.at_border[k] = edge.triangles == 1;
      if (!t.at_border[k]) continue;
      mesh.border_vertices[t.vertices[k]] = true;
      mesh.border_vertices[t.vertices[(k + 1) % 3]] = true;
    }
  number_parts(mesh);
  mesh.order.resize(mesh.triangles.size());
  std::iota(mesh.order.begin(), mesh.order.end(), 0);
  mesh.nodes.push_back(box_about(mesh, 0, mesh.size()));
  divide(mesh, 0);
  return mesh;
}

SurfacePlace nearest_on(const SurfaceMesh& mesh, int triangle, const Vector3<double>& point) {
  const SurfaceTriangle& t = mesh.triangles[triangle];
  // Beyond an edge where the point lies outside of it, in the plane of the triangle.
  bool inside = true;
  SurfacePlace best{.distance = std::numeric_limits<double>::infinity()};
  for (int k = 0; k < 3; ++k) {
    const V along = t.corners[(k + 1) % 3] - t.corners[k];
    if (dot(cross(along, point - t.corners[k]), t.normal) >= 0) continue;
    inside = false;
    const SurfacePlace on_edge = nearest_on_edge(t, triangle, k, point);
    if (on_edge.distance < best.distance) best = on_edge;
  }
  if (!inside) return best;
  const double height = dot(t.normal, point - t.corners[0]);
  return {triangle, SurfaceFeature::face, 0, point - height * t.normal, std::abs(height)};
}

SurfacePlace nearest_on(const SurfaceMesh& mesh, const Vector3<double>& point) {
  SurfacePlace best{.distance = std::numeric_limits<double>::infinity()};
  struct Waiting {
    int node;
    double squared;
  };
  std::array<Waiting, 64> waiting{};
  int count = 0;
  waiting[count++] = {0, squared_distance(mesh.nodes[0], point)};
  while (count > 0) {
    const Waiting next = waiting[--count];
    if (next.squared > best.distance * best.distance) continue;
    const SurfaceNode& node = mesh.nodes[next.node];
    if (node.count == 0) {
      Waiting near{node.first, squared_distance(mesh.nodes[node.first], point)},
          far{node.first + 1, squared_distance(mesh.nodes[node.first + 1], point)};
      if (far.squared < near.squared) std::swap(near, far);
      waiting[count++] = far;
      waiting[count++] = near;
      continue;
    }
    for (int k = 0; k < node.count; ++k) {
      const SurfacePlace place = nearest_on(mesh, mesh.order[node.first + k], point);
      if (place.distance < best.distance ||
          (place.distance == best.distance && place.triangle < best.triangle))
        best = place;
    }
  }
  return best;
}

std::vector<SurfacePlace> near_on(const SurfaceMesh& mesh, const Vector3<double>& point, double reach) {
  std::vector<SurfacePlace> places;
  walk(
      mesh, [&](const SurfaceNode& node) { return squared_distance(node, point) <= reach * reach; },
      [&](int triangle) {
        const SurfacePlace place = nearest_on(mesh, triangle, point);
        if (place.distance <= reach) places.push_back(place);
      });
  std::sort(places.begin(), places.end(),
            [](const SurfacePlace& a, const SurfacePlace& b) { return a.triangle < b.triangle; });
  return places;
}

const Vector3<double>& pseudonormal(const SurfaceMesh& mesh, const SurfacePlace& place) {
  const SurfaceTriangle& t = mesh.triangles[place.triangle];
  if (place.feature == SurfaceFeature::face) return t.normal;
  if (place.feature == SurfaceFeature::edge) return t.edge_normals[place.number];
  return mesh.vertex_normals[t.vertices[place.number]];
}

bool is_on_border(const SurfaceMesh& mesh, const SurfacePlace& place) {
  const SurfaceTriangle& t = mesh.triangles[place.triangle];
  return place.feature == SurfaceFeature::edge     ? t.at_border[place.number]
         : place.feature == SurfaceFeature::corner ? mesh.border_vertices[t.vertices[place.number]]
                                                   : false;
}

std::vector<SurfaceCrossing> crossings_of(const SurfaceMesh& mesh, const Vector3<double>& from,
                                          const Vector3<double>& to) {
  std::vector<SurfaceCrossing> crossings;
  const V way = to - from, inverse{1 / way.x, 1 / way.y, 1 / way.z};
  if (way.x == 0 && way.y == 0 && way.z == 0) return crossings;
  const Sight sight(from, way);
  walk(
      mesh, [&](const SurfaceNode& node) { return may_meet(node, from, inverse); },
      [&](int triangle) {
        const SurfaceTriangle& t = mesh.triangles[triangle];
        const double before = dot(t.normal, from - t.corners[0]), after = dot(t.normal, to - t.corners[0]);
        if (before == after || (before > 0 && after > 0) || (before < 0 && after < 0)) return;
        if (!sight.meets(t)) return;
        crossings.push_back({before / (before - after), triangle, after > before});
      });
  std::sort(crossings.begin(), crossings.end(), [](const SurfaceCrossing& a, const SurfaceCrossing& b) {
    return a.share != b.share ? a.share < b.share : a.triangle < b.triangle;
  });
  return crossings;
}

}  // namespace flash::sim
