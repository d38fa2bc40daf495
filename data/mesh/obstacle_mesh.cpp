#include "data/mesh/obstacle_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "data/files/error.h"
#include "data/files/text.h"
#include "data/mesh/connected_parts.h"
#include "data/mesh/enclosed_volume.h"
#include "data/mesh/mesh_io.h"
#include "data/mesh/surface_crossing.h"
#include "data/mesh/weld.h"

namespace flash::data {
namespace {

int count_border_edges(const Triangles& triangles) {
  std::map<std::array<int, 2>, int> uses;
  for (const auto& t : triangles.rowwise())
    for (int k = 0; k < 3; ++k) ++uses[{std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])}];
  return static_cast<int>(
      std::count_if(uses.begin(), uses.end(), [](const auto& edge) { return edge.second == 1; }));
}

/// A vertex whose triangles do not hang together over edges; -1: there is none.
int pinched_vertex(const TriangleMesh& mesh) {
  // Of each vertex the other ends of its triangles' edges. Triangles with one in common hang together.
  std::vector<std::vector<std::array<int, 2>>> fans(static_cast<std::size_t>(mesh.vertices.rows()));
  for (const auto& t : mesh.triangles.rowwise())
    for (int k = 0; k < 3; ++k)
      fans[static_cast<std::size_t>(t[k])].push_back({t[(k + 1) % 3], t[(k + 2) % 3]});
  for (std::size_t vertex = 0; vertex < fans.size(); ++vertex) {
    std::vector<std::array<int, 2>>& fan = fans[vertex];
    std::set<int> reached = {fan[0][0], fan[0][1]};
    for (bool grows = true; grows;) {
      grows = false;
      for (const auto& [a, b] : fan)
        if (reached.contains(a) != reached.contains(b)) {
          reached.insert({a, b});
          grows = true;
        }
    }
    if (std::any_of(fan.begin(), fan.end(), [&](const auto& ends) { return !reached.contains(ends[0]); }))
      return static_cast<int>(vertex);
  }
  return -1;
}

}  // namespace

void check_crossings(const TriangleMesh& mesh, const std::string& source, std::span<const int> part) {
  const std::optional<TrianglePair> found = first_crossing(mesh, part);
  if (!found) return;
  const auto corners = [&](int t) {
    const auto& row = mesh.triangles.row(t);
    return "vertices " + std::to_string(row[0]) + ", " + std::to_string(row[1]) + ", " +
           std::to_string(row[2]);
  };
  const Eigen::RowVector3d place = mesh.vertices.row(mesh.triangles(found->first, 0));
  throw input_error(source, "triangle " + std::to_string(found->second),
                    "of " + corners(found->second) + " passes through triangle " +
                        std::to_string(found->first) + " of " + corners(found->first) + ", near (" +
                        format_short(place[0]) + ", " + format_short(place[1]) + ", " +
                        format_short(place[2]) +
                        "); expected a closed surface that does not meet itself, which has one inside");
}

ObstacleMesh checked_obstacle_mesh(TriangleMesh mesh, const std::string& source) {
  check_triangle_mesh(mesh, source);
  ObstacleMesh result{std::move(mesh)};
  result.border_edges = count_border_edges(result.mesh.triangles);
  if (result.border_edges > 0) {
    result.mesh = welded(result.mesh);
    check_triangle_mesh(result.mesh, source);
    result.border_edges = count_border_edges(result.mesh.triangles);
  }
  result.closed = result.border_edges == 0;
  if (const int vertex = pinched_vertex(result.mesh); vertex >= 0) {
    const Eigen::RowVector3d place = result.mesh.vertices.row(vertex);
    throw input_error(source, "vertex " + std::to_string(vertex),
                      "joins parts of the surface that share no edge there, at (" + format_short(place[0]) +
                          ", " + format_short(place[1]) + ", " + format_short(place[2]) +
                          "); expected one fan of triangles about each vertex");
  }
  // Whole parts may reach into each other, as a chair's legs into its seat: what is in one of them is inside.
  if (result.closed) check_crossings(result.mesh, source, first_of_part(result.mesh));
  if (result.closed)
    if (const double volume = enclosed_volume(result.mesh); !(volume > 0))
      throw InputError(source + ": is inside out: found a volume of " + format_short(volume) +
                       " m^3, expected triangles that run counter-clockwise seen from outside");
  return result;
}

ObstacleMesh load_obstacle_mesh(const std::string& path, double scale) {
  Geometry geometry = load_geometry(path);
  return checked_obstacle_mesh({scale * geometry.points, std::move(geometry.triangles)}, path);
}

}  // namespace flash::data
