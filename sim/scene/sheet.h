#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "data/mesh/mesh.h"

namespace flash::sim {

/// A triangle of the rest shape in its own plane.
struct RestTriangle {
  Eigen::Vector3i vertices;
  Eigen::Matrix2d inverse_edges;  ///< inverse of the 2 x 2 matrix of rest edges (x1 - x0, x2 - x0) [1/m]
  double area;                    ///< [m^2]
  bool stiff = false;             ///< inside a clamp: does not bend
  /// The mesh's x axis in the triangle's plane, its y axis where x stands upright.
  Eigen::Vector2d x_axis = Eigen::Vector2d::UnitX();
};

/// A tetrahedron of the rest shape.
struct RestTetrahedron {
  Eigen::Vector4i vertices;
  Eigen::Matrix3d inverse_edges;  ///< inverse of the matrix of rest edges (x1 - x0, x2 - x0, x3 - x0) [1/m]
  double volume;                  ///< [m^3]
  /// Of a quadratic element: the vertices in the middle of its edges 01, 02, 03, 12, 13 and 23. Else -1.
  std::array<int, 6> midsides = {-1, -1, -1, -1, -1, -1};

  bool is_quadratic() const { return midsides[0] >= 0; }
};

/// A vertex that stands in the middle of an edge of quadratic tetrahedra, at rest.
struct Midside {
  int vertex;
  std::array<int, 2> ends;
};

/// A part of the mesh with a material of its own: a sheet of triangles, or a solid of tetrahedra. Its
/// vertices and its elements stand side by side.
struct Body {
  std::string name = {};  ///< for messages
  int first_vertex = 0, vertex_count = 0;
  int first_triangle = 0, triangle_count = 0;
  int first_tetrahedron = 0, tetrahedron_count = 0;

  bool is_solid() const { return tetrahedron_count > 0; }
};

/// What all environments of one mesh share: the rest shape, never a material.
struct Sheet {
  data::TriangleMesh rest;  ///< all vertices, and the triangles that are elements
  std::vector<RestTriangle> triangles;
  Eigen::VectorXd vertex_area;  ///< a third of the area of the adjacent triangles [m^2]
  std::vector<Body> bodies;     ///< one, or those that were joined, in the order of their vertices
  // Of the solid bodies; empty where there are none.
  std::vector<RestTetrahedron> tetrahedra = {};
  data::Triangles solid_surface = {};  ///< outer faces, counter-clockwise seen from outside
  Eigen::VectorXd vertex_volume = {};  ///< share of the volume of the adjacent tetrahedra [m^3]
  std::vector<Midside> midsides = {};  ///< of quadratic bodies, each behind the body's other vertices
};

/// A sheet of one body. `axes`: those of the mesh, from which its warp is counted, where it has been turned.
/// Throws data::InputError on degenerate or duplicate triangles and on vertices without a triangle.
Sheet make_sheet(const data::TriangleMesh& rest, const std::string& name = {},
                 const Eigen::Matrix3d& axes = Eigen::Matrix3d::Identity());

/// Two triangles of a flat rest shape with a common edge that lie on the same side of it, so that they cover
/// each other; those of the lowest numbers. Empty where there are none, or where the shape is not flat.
std::optional<std::pair<int, int>> first_overlap(const data::TriangleMesh& rest);

/// Whether any body is a solid.
bool has_solids(const Sheet& sheet);

/// All triangles that can be seen: elements of the sheets, then outer faces of the solids.
data::Triangles visible_triangles(const Sheet& sheet);

/// The bodies of all `sheets` in one mesh, vertices and elements in the order of the list.
Sheet joined(std::span<const Sheet> sheets);

/// One body of a sheet as a sheet of its own.
Sheet body_alone(const Sheet& sheet, const Body& body);

/// Number of the body that a vertex belongs to.
int body_of(const Sheet& sheet, int vertex);

/// The body's rows of an array with a row for each vertex of the sheet.
template <class Rows>
auto rows_of(const Body& body, Rows& rows) {
  return rows.middleRows(body.first_vertex, body.vertex_count);
}

}  // namespace flash::sim
