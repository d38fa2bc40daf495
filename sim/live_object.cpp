#include "sim/live_object.h"

#include <utility>
#include <vector>

namespace flash::sim {
namespace {

/// Those of a body, by its own vertices.
data::Triangles visible_triangles_of(const Body& body, const data::Triangles& all) {
  std::vector<Eigen::Index> own;
  for (Eigen::Index t = 0; t < all.rows(); ++t)
    if (all(t, 0) >= body.first_vertex && all(t, 0) < body.first_vertex + body.vertex_count) own.push_back(t);
  return all(own, Eigen::all).array() - body.first_vertex;
}

}  // namespace

LiveObject live_object(const Sheet& sheet, std::size_t body, std::string name, std::size_t worlds) {
  const Body& part = sheet.bodies[body];
  return {.name = std::move(name),
          .triangles = visible_triangles_of(part, visible_triangles(sheet)),
          .is_solid = part.is_solid(),
          .worlds = worlds,
          .body = static_cast<int>(body),
          .first_vertex = part.first_vertex,
          .vertices = part.vertex_count};
}

Tensor rows_of(const LiveObject& object, Tensor all) {
  const std::int64_t vertices = all.shape[1];
  all.data = static_cast<const double*>(all.data) + 3 * object.first_vertex;
  all.shape[1] = object.vertices;
  all.strides = {3 * vertices, 3, 1};
  return all;
}

SeenMesh seen(const LiveObject& object, const Tensor& positions, std::span<const int> chosen) {
  SeenMesh mesh{.triangles = &object.triangles, .vertex_count = object.vertices};
  const Tensor own = rows_of(object, positions);
  for (const int e : chosen)
    mesh.vertices.push_back(static_cast<const double*>(own.data) + e * own.strides.front());
  return mesh;
}

}  // namespace flash::sim
