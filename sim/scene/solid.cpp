#include "sim/scene/solid.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "data/mesh_io.h"
#include "data/tet_faces.h"

namespace flash::sim {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

Matrix3d edges_of(const data::Points& positions, const Eigen::Vector4i& t) {
  Matrix3d edges;
  for (int k = 0; k < 3; ++k) edges.col(k) = positions.row(t[k + 1]) - positions.row(t[0]);
  return edges;
}

}  // namespace

Sheet make_solid(const data::TetMesh& rest, const std::string& name) {
  data::check_tet_mesh(rest, "mesh");
  const Eigen::Index vertices = rest.vertices.rows();
  Sheet sheet;
  sheet.rest.vertices = rest.vertices;
  sheet.rest.triangles.resize(0, 3);
  sheet.vertex_area = sheet.vertex_volume = Eigen::VectorXd::Zero(vertices);
  for (Eigen::Index t = 0; t < rest.tetrahedra.rows(); ++t) {
    const Eigen::Vector4i corners = rest.tetrahedra.row(t);
    const Matrix3d edges = edges_of(rest.vertices, corners);
    const double volume = edges.determinant() / 6;
    sheet.tetrahedra.push_back({corners, edges.inverse(), volume});
    for (const int corner : corners) sheet.vertex_volume[corner] += volume / 4;
  }
  sheet.solid_surface = data::outer_faces(rest.tetrahedra);
  for (Eigen::Index f = 0; f < sheet.solid_surface.rows(); ++f) {
    const Eigen::Vector3i v = sheet.solid_surface.row(f);
    const Vector3d a = rest.vertices.row(v[1]) - rest.vertices.row(v[0]),
                   b = rest.vertices.row(v[2]) - rest.vertices.row(v[0]);
    for (const int corner : v) sheet.vertex_area[corner] += a.cross(b).norm() / 6;
  }
  sheet.bodies = {{.name = name,
                   .vertex_count = static_cast<int>(vertices),
                   .tetrahedron_count = static_cast<int>(rest.tetrahedra.rows())}};
  return sheet;
}

int first_inverted(const Sheet& sheet, const data::Points& positions) {
  for (std::size_t t = 0; t < sheet.tetrahedra.size(); ++t)
    if (!(edges_of(positions, sheet.tetrahedra[t].vertices).determinant() > 0)) return static_cast<int>(t);
  return -1;
}

}  // namespace flash::sim
