#pragma once
#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "data/mesh.h"

namespace flash::sim {

/// A triangle of the rest shape in its own plane.
struct RestTriangle {
  Eigen::Vector3i vertices;
  Eigen::Matrix2d inverse_edges;  ///< inverse of the 2 x 2 matrix of rest edges (x1 - x0, x2 - x0) [1/m]
  double area;                    ///< [m^2]
  bool stiff = false;             ///< inside a clamp: does not bend (plate only)
};

/// A part of the mesh with a material of its own. Its vertices and its triangles stand side by side.
struct Body {
  std::string name = {};  ///< for messages
  int first_vertex = 0, vertex_count = 0;
  int first_triangle = 0, triangle_count = 0;
};

/// What all environments of one mesh share: the rest shape, never a material.
struct Sheet {
  data::TriangleMesh rest;
  std::vector<RestTriangle> triangles;
  Eigen::VectorXd vertex_area;  ///< a third of the area of the adjacent triangles [m^2]
  std::vector<Body> bodies;     ///< one, or those that were joined, in the order of their vertices
};

/// A sheet of one body. Throws data::InputError on degenerate or duplicate triangles and on vertices without
/// a triangle.
Sheet make_sheet(const data::TriangleMesh& rest, const std::string& name = {});

/// The bodies of all `sheets` in one mesh, vertices and triangles in the order of the list.
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
