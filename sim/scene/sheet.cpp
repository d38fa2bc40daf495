#include "sim/scene/sheet.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "data/files/error.h"

namespace flash::sim {

Sheet make_sheet(const data::TriangleMesh& rest, const std::string& name, const Eigen::Matrix3d& axes) {
  Sheet sheet{rest,
              {},
              Eigen::VectorXd::Zero(rest.vertices.rows()),
              {{.name = name,
                .vertex_count = static_cast<int>(rest.vertices.rows()),
                .triangle_count = static_cast<int>(rest.triangles.rows())}}};
  std::map<std::array<int, 3>, int> seen;
  const double extent = rest.vertices.rows() > 0
                            ? (rest.vertices.colwise().maxCoeff() - rest.vertices.colwise().minCoeff()).norm()
                            : 0.0;
  for (int t = 0; t < rest.triangles.rows(); ++t) {
    const std::string where = "triangle " + std::to_string(t);
    const Eigen::Vector3i v = rest.triangles.row(t);
    if (v.minCoeff() < 0 || v.maxCoeff() >= rest.vertices.rows())
      throw data::input_error("mesh", where, "vertex index out of range");
    std::array<int, 3> sorted = {v[0], v[1], v[2]};
    std::sort(sorted.begin(), sorted.end());
    if (const auto [other, fresh] = seen.try_emplace(sorted, t); !fresh)
      throw data::input_error("mesh", where, "the same triangle as " + std::to_string(other->second));
    const Eigen::Vector3d edge1 = rest.vertices.row(v[1]) - rest.vertices.row(v[0]);
    const Eigen::Vector3d edge2 = rest.vertices.row(v[2]) - rest.vertices.row(v[0]);
    const Eigen::Vector3d normal = edge1.cross(edge2);
    const double area = 0.5 * normal.norm();
    if (!(area > 1e-14 * extent * extent))
      throw data::input_error("mesh", where, "degenerate, its area is zero");
    const Eigen::Vector3d axis1 = edge1.normalized(), axis2 = normal.normalized().cross(axis1);
    Eigen::Matrix2d edges;
    edges << edge1.dot(axis1), edge2.dot(axis1), edge1.dot(axis2), edge2.dot(axis2);
    sheet.triangles.push_back({v, edges.inverse(), area});
    const auto in_plane = [&](int axis) {
      return Eigen::Vector2d(axis1.dot(axes.col(axis)), axis2.dot(axes.col(axis)));
    };
    const Eigen::Vector2d along_x = in_plane(0);
    sheet.triangles.back().x_axis = (along_x.norm() > 1e-6 ? along_x : in_plane(1)).normalized();
    for (int corner : {v[0], v[1], v[2]}) sheet.vertex_area[corner] += area / 3;
  }
  for (int i = 0; i < rest.vertices.rows(); ++i)
    if (sheet.vertex_area[i] == 0)
      throw data::input_error("mesh", "vertex " + std::to_string(i), "belongs to no triangle");
  return sheet;
}

std::optional<std::pair<int, int>> first_overlap(const data::TriangleMesh& rest) {
  const auto at = [&](int vertex) -> Eigen::Vector3d { return rest.vertices.row(vertex); };
  const auto normal_of = [&](int t) {
    const Eigen::Vector3i v = rest.triangles.row(t);
    return Eigen::Vector3d((at(v[1]) - at(v[0])).cross(at(v[2]) - at(v[0])));
  };
  constexpr double flat = 1e-6;  // height over size
  if (rest.triangles.rows() == 0) return {};
  int largest = 0;
  for (int t = 1; t < rest.triangles.rows(); ++t)
    if (normal_of(t).norm() > normal_of(largest).norm()) largest = t;
  const Eigen::Vector3d normal = normal_of(largest).normalized(), centre = rest.vertices.colwise().mean();
  const data::Points d = rest.vertices.rowwise() - centre.transpose();
  if ((d * normal).cwiseAbs().maxCoeff() > flat * d.rowwise().norm().maxCoeff()) return {};
  std::map<std::pair<int, int>, std::pair<int, bool>> seen;  // of an edge: a triangle and its side
  std::optional<std::pair<int, int>> found;
  for (int t = 0; t < rest.triangles.rows() && !found; ++t)
    for (int k = 0; k < 3; ++k) {
      const int a = rest.triangles(t, k), b = rest.triangles(t, (k + 1) % 3),
                c = rest.triangles(t, (k + 2) % 3);
      const auto [low, high] = std::minmax(a, b);
      const bool side = (at(high) - at(low)).cross(at(c) - at(low)).dot(normal) > 0;
      const auto [other, fresh] = seen.try_emplace({low, high}, t, side);
      if (!fresh && other->second.second == side && !found) found = {other->second.first, t};
    }
  return found;
}

bool has_solids(const Sheet& sheet) { return !sheet.tetrahedra.empty(); }

data::Triangles visible_triangles(const Sheet& sheet) {
  const Eigen::Index elements = sheet.rest.triangles.rows(), faces = sheet.solid_surface.rows();
  data::Triangles all(elements + faces, 3);
  all.topRows(elements) = sheet.rest.triangles;
  all.bottomRows(faces) = sheet.solid_surface;
  return all;
}

Sheet joined(std::span<const Sheet> sheets) {
  Sheet whole;
  Eigen::Index vertices = 0, triangles = 0, faces = 0;
  for (const Sheet& sheet : sheets) {
    vertices += sheet.rest.vertices.rows();
    triangles += sheet.rest.triangles.rows();
    faces += sheet.solid_surface.rows();
  }
  whole.solid_surface.resize(faces, 3);
  if (std::any_of(sheets.begin(), sheets.end(), has_solids))
    whole.vertex_volume = Eigen::VectorXd::Zero(vertices);
  whole.rest.vertices.resize(vertices, 3);
  whole.rest.triangles.resize(triangles, 3);
  whole.vertex_area.resize(vertices);
  int first_vertex = 0, first_triangle = 0, first_tetrahedron = 0;
  Eigen::Index first_face = 0;
  for (const Sheet& sheet : sheets) {
    const Eigen::Index own_vertices = sheet.rest.vertices.rows(), own_triangles = sheet.rest.triangles.rows();
    whole.rest.vertices.middleRows(first_vertex, own_vertices) = sheet.rest.vertices;
    whole.rest.triangles.middleRows(first_triangle, own_triangles) =
        sheet.rest.triangles.array() + first_vertex;
    whole.vertex_area.segment(first_vertex, own_vertices) = sheet.vertex_area;
    for (RestTriangle triangle : sheet.triangles) {
      triangle.vertices.array() += first_vertex;
      whole.triangles.push_back(triangle);
    }
    if (has_solids(sheet)) whole.vertex_volume.segment(first_vertex, own_vertices) = sheet.vertex_volume;
    const Eigen::Index own_faces = sheet.solid_surface.rows();
    whole.solid_surface.middleRows(first_face, own_faces) = sheet.solid_surface.array() + first_vertex;
    for (RestTetrahedron tetrahedron : sheet.tetrahedra) {
      tetrahedron.vertices.array() += first_vertex;
      if (tetrahedron.is_quadratic())
        for (int& midside : tetrahedron.midsides) midside += first_vertex;
      whole.tetrahedra.push_back(tetrahedron);
    }
    for (const auto& [vertex, ends] : sheet.midsides)
      whole.midsides.push_back({vertex + first_vertex, {ends[0] + first_vertex, ends[1] + first_vertex}});
    for (Body body : sheet.bodies) {
      body.first_vertex += first_vertex;
      body.first_triangle += first_triangle;
      body.first_tetrahedron += first_tetrahedron;
      whole.bodies.push_back(body);
    }
    first_tetrahedron += static_cast<int>(sheet.tetrahedra.size());
    first_face += own_faces;
    first_vertex += static_cast<int>(own_vertices);
    first_triangle += static_cast<int>(own_triangles);
  }
  return whole;
}

Sheet body_alone(const Sheet& sheet, const Body& body) {
  Sheet alone;
  alone.rest.vertices = rows_of(body, sheet.rest.vertices);
  alone.rest.triangles =
      sheet.rest.triangles.middleRows(body.first_triangle, body.triangle_count).array() - body.first_vertex;
  alone.vertex_area = sheet.vertex_area.segment(body.first_vertex, body.vertex_count);
  for (int t = 0; t < body.triangle_count; ++t) {
    alone.triangles.push_back(sheet.triangles[body.first_triangle + t]);
    alone.triangles.back().vertices.array() -= body.first_vertex;
  }
  alone.bodies = {body};
  alone.bodies.front().first_vertex = alone.bodies.front().first_triangle = 0;
  return alone;
}

int body_of(const Sheet& sheet, int vertex) {
  int body = 0;
  while (vertex >= sheet.bodies[body].first_vertex + sheet.bodies[body].vertex_count) ++body;
  return body;
}

}  // namespace flash::sim
