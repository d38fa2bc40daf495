#include "sim/scene/solid.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "data/mesh/mesh_io.h"
#include "data/mesh/tet_faces.h"

namespace flash::sim {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

Matrix3d edges_of(const data::Points& positions, const Eigen::Vector4i& t) {
  Matrix3d edges;
  for (int k = 0; k < 3; ++k) edges.col(k) = positions.row(t[k + 1]) - positions.row(t[0]);
  return edges;
}

/// The corners of a sheet of quadratic elements, with the vertices that their edges get.
class EdgeMiddles {
 public:
  explicit EdgeMiddles(Sheet& sheet) : sheet_(sheet) {}

  int between(int a, int b) {
    const auto [entry, fresh] =
        made_.try_emplace(std::minmax(a, b), static_cast<int>(sheet_.rest.vertices.rows() + count()));
    if (fresh) sheet_.midsides.push_back({entry->second, {a, b}});
    return entry->second;
  }

 private:
  Eigen::Index count() const { return static_cast<Eigen::Index>(sheet_.midsides.size()); }

  Sheet& sheet_;
  std::map<std::pair<int, int>, int> made_;
};

/// Each face by four, over the vertices in the middle of its edges.
data::Triangles divided_faces(const data::Triangles& faces, EdgeMiddles& middles) {
  data::Triangles divided(4 * faces.rows(), 3);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Eigen::Vector3i v = faces.row(f);
    const int ab = middles.between(v[0], v[1]), bc = middles.between(v[1], v[2]),
              ca = middles.between(v[2], v[0]);
    divided.middleRows(4 * f, 4) << v[0], ab, ca, v[1], bc, ab, v[2], ca, bc, ab, bc, ca;
  }
  return divided;
}

/// Shares of the volume of a quadratic tetrahedron: in proportion to the diagonal of its mass matrix (Hinton,
/// Rock and Zienkiewicz 1976). Rows summed up would leave corners a negative mass.
constexpr double corner_share = 1.0 / 36, midside_share = 4.0 / 27;

void make_quadratic(Sheet& sheet) {
  EdgeMiddles middles(sheet);
  for (RestTetrahedron& tetrahedron : sheet.tetrahedra)
    for (std::size_t k = 0; k < tetrahedron_edges.size(); ++k)
      tetrahedron.midsides[k] = middles.between(tetrahedron.vertices[tetrahedron_edges[k][0]],
                                                tetrahedron.vertices[tetrahedron_edges[k][1]]);
  sheet.solid_surface = divided_faces(sheet.solid_surface, middles);
  sheet.rest.vertices = with_midsides(sheet, sheet.rest.vertices);
}

Eigen::VectorXd vertex_volumes(const Sheet& sheet) {
  Eigen::VectorXd volumes = Eigen::VectorXd::Zero(sheet.rest.vertices.rows());
  for (const RestTetrahedron& tetrahedron : sheet.tetrahedra) {
    const bool quadratic = tetrahedron.is_quadratic();
    for (const int corner : tetrahedron.vertices)
      volumes[corner] += quadratic ? corner_share * tetrahedron.volume : tetrahedron.volume / 4;
    if (quadratic)
      for (const int midside : tetrahedron.midsides) volumes[midside] += midside_share * tetrahedron.volume;
  }
  return volumes;
}

Eigen::VectorXd surface_areas(const Sheet& sheet) {
  Eigen::VectorXd areas = Eigen::VectorXd::Zero(sheet.rest.vertices.rows());
  for (Eigen::Index f = 0; f < sheet.solid_surface.rows(); ++f) {
    const Eigen::Vector3i v = sheet.solid_surface.row(f);
    const data::Points& x = sheet.rest.vertices;
    const Vector3d a = x.row(v[1]) - x.row(v[0]), b = x.row(v[2]) - x.row(v[0]);
    for (const int corner : v) areas[corner] += a.cross(b).norm() / 6;
  }
  return areas;
}

}  // namespace

Sheet make_solid(const data::TetMesh& rest, const std::string& name, data::ElementOrder order) {
  data::check_tet_mesh(rest, "mesh");
  Sheet sheet;
  sheet.rest.vertices = rest.vertices;
  sheet.rest.triangles.resize(0, 3);
  for (Eigen::Index t = 0; t < rest.tetrahedra.rows(); ++t) {
    const Eigen::Vector4i corners = rest.tetrahedra.row(t);
    const Matrix3d edges = edges_of(rest.vertices, corners);
    sheet.tetrahedra.push_back({corners, edges.inverse(), edges.determinant() / 6});
  }
  sheet.solid_surface = data::outer_faces(rest.tetrahedra);
  if (order == data::ElementOrder::quadratic) make_quadratic(sheet);
  sheet.vertex_volume = vertex_volumes(sheet);
  sheet.vertex_area = surface_areas(sheet);
  sheet.bodies = {{.name = name,
                   .vertex_count = static_cast<int>(sheet.rest.vertices.rows()),
                   .tetrahedron_count = static_cast<int>(rest.tetrahedra.rows())}};
  return sheet;
}

bool is_quadratic(const Sheet& sheet, const Body& body) {
  return body.is_solid() && sheet.tetrahedra[static_cast<std::size_t>(body.first_tetrahedron)].is_quadratic();
}

Eigen::Index mesh_vertices(const Sheet& sheet) {
  return sheet.rest.vertices.rows() - static_cast<Eigen::Index>(sheet.midsides.size());
}

data::Points with_midsides(const Sheet& sheet, const data::Points& positions) {
  data::Points all(positions.rows() + static_cast<Eigen::Index>(sheet.midsides.size()), 3);
  all.topRows(positions.rows()) = positions;
  for (const auto& [vertex, ends] : sheet.midsides)
    all.row(vertex) = 0.5 * (positions.row(ends[0]) + positions.row(ends[1]));
  return all;
}

std::vector<int> with_midsides(const Sheet& sheet, std::vector<int> vertices) {
  const std::set<int> those(vertices.begin(), vertices.end());
  for (const auto& [vertex, ends] : sheet.midsides)
    if (those.count(ends[0]) > 0 && those.count(ends[1]) > 0 && those.count(vertex) == 0)
      vertices.push_back(vertex);
  return vertices;
}

int first_inverted(const Sheet& sheet, const data::Points& positions) {
  for (std::size_t t = 0; t < sheet.tetrahedra.size(); ++t)
    if (!(edges_of(positions, sheet.tetrahedra[t].vertices).determinant() > 0)) return static_cast<int>(t);
  return -1;
}

int count_collapsed(const Sheet& sheet, const Body& body, const data::Points& positions) {
  const auto first = sheet.tetrahedra.begin() + body.first_tetrahedron;
  return static_cast<int>(std::count_if(first, first + body.tetrahedron_count, [&](const RestTetrahedron& t) {
    return !(edges_of(positions, t.vertices).determinant() >= collapsed_volume_share * 6 * t.volume);
  }));
}

}  // namespace flash::sim
