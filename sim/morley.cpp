#include "sim/morley.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "data/error.h"

namespace flash::sim {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Triplets = std::vector<Eigen::Triplet<double>>;

Sparse sparse(Eigen::Index rows, Eigen::Index cols, const Triplets& entries) {
  Sparse matrix(rows, cols);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

// Coordinates in the plane of the rest shape, seen from the side of its normals.
Eigen::Matrix2Xd plane_coordinates(const Sheet& sheet) {
  const data::Points& x = sheet.rest.vertices;
  const auto at = [&](int vertex) -> Eigen::Vector3d { return x.row(vertex); };
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (const RestTriangle& t : sheet.triangles) {
    const Eigen::Vector3d a = at(t.vertices[0]);
    normal += (at(t.vertices[1]) - a).cross(at(t.vertices[2]) - a);
  }
  normal.normalize();
  const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
  const Eigen::Vector3d centre = x.colwise().mean();
  Eigen::Matrix2Xd plane(2, x.rows());
  double size = 0, height = 0;
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const Eigen::Vector3d d = at(int(i)) - centre;
    plane.col(i) << u.dot(d), v.dot(d);
    size = std::max(size, d.norm());
    height = std::max(height, std::abs(normal.dot(d)));
  }
  if (!(height <= 1e-6 * size))
    throw data::input_error("mesh", "bending_model",
                            "plate needs a flat rest shape; this one leaves its plane by " +
                                std::to_string(height) + " m (use hinge)");
  return plane;
}

Sparse without_small_entries(const Sparse& matrix, double drop_tolerance) {
  const Eigen::VectorXd diagonal = matrix.diagonal();
  Triplets entries;
  entries.reserve(matrix.nonZeros());
  for (int j = 0; j < matrix.outerSize(); ++j)
    for (Sparse::InnerIterator it(matrix, j); it; ++it) {
      const bool small = std::abs(it.value()) < drop_tolerance * std::sqrt(diagonal[it.row()] * diagonal[j]);
      entries.emplace_back(small ? j : int(it.row()), j, it.value());
    }
  return sparse(matrix.rows(), matrix.cols(), entries);
}

}  // namespace

MorleyPlate morley_plate(const Sheet& sheet, double poissons_ratio) {
  if (!(poissons_ratio > -1 && poissons_ratio < 1))
    throw data::input_error("material", "poisson",
                            std::to_string(poissons_ratio) + ", expected within (-1, 1)");
  const Eigen::Matrix2Xd plane = plane_coordinates(sheet);
  MorleyPlate plate;
  plate.edges = sheet_edges(sheet);
  std::vector<Eigen::Vector3i> triangle_edges(sheet.triangles.size());
  const auto side = [&](int triangle, int opposite) -> int& {
    const Eigen::Vector3i& v = sheet.triangles[triangle].vertices;
    return triangle_edges[triangle][v[0] == opposite ? 0 : v[1] == opposite ? 1 : 2];
  };
  for (int i = 0; i < int(plate.edges.size()); ++i) {
    const Edge& e = plate.edges[i];
    side(e.left, e.opposite_left) = i;
    if (e.right >= 0) side(e.right, e.opposite_right) = i;
  }

  Eigen::Matrix3d rigidity;  // on (k11, k22, k12)
  rigidity << 1, poissons_ratio, 0, poissons_ratio, 1, 0, 0, 0, 2 * (1 - poissons_ratio);
  Triplets xx, xe, ee;
  for (std::size_t t = 0; t < sheet.triangles.size(); ++t) {
    const RestTriangle& triangle = sheet.triangles[t];
    Eigen::Matrix3d by_vertex = Eigen::Matrix3d::Zero(),
                    by_edge;  // A times the curvature: columns are unknowns
    for (int i = 0; i < 3; ++i) {
      const int from = (i + 1) % 3, to = (i + 2) % 3;
      const Eigen::Vector2d along = plane.col(triangle.vertices[to]) - plane.col(triangle.vertices[from]);
      const double length = along.norm();
      const Eigen::Vector2d tangent = along / length, outward(tangent.y(), -tangent.x());
      const Eigen::Vector3d mixed(outward.x() * tangent.x(), outward.y() * tangent.y(),
                                  0.5 * (outward.x() * tangent.y() + outward.y() * tangent.x()));
      by_vertex.col(to) += mixed;
      by_vertex.col(from) -= mixed;
      const double sign = plate.edges[triangle_edges[t][i]].left == int(t) ? 1.0 : -1.0;
      by_edge.col(i) =
          sign * length *
          Eigen::Vector3d(outward.x() * outward.x(), outward.y() * outward.y(), outward.x() * outward.y());
    }
    const Eigen::Matrix3d element_xx = by_vertex.transpose() * rigidity * by_vertex / triangle.area;
    const Eigen::Matrix3d element_xe = by_vertex.transpose() * rigidity * by_edge / triangle.area;
    const Eigen::Matrix3d element_ee = by_edge.transpose() * rigidity * by_edge / triangle.area;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        xx.emplace_back(triangle.vertices[i], triangle.vertices[j], element_xx(i, j));
        xe.emplace_back(triangle.vertices[i], triangle_edges[t][j], element_xe(i, j));
        ee.emplace_back(triangle_edges[t][i], triangle_edges[t][j], element_ee(i, j));
      }
  }
  const auto vertices = sheet.rest.vertices.rows(), edges = Eigen::Index(plate.edges.size());
  plate.xx = sparse(vertices, vertices, xx);
  plate.xe = sparse(vertices, edges, xe);
  plate.ee = sparse(edges, edges, ee);
  return plate;
}

CondensedPlate condensed_plate(const Sheet& sheet, double poissons_ratio,
                               const std::vector<ClampedEdge>& clamped, double drop_tolerance) {
  const MorleyPlate plate = morley_plate(sheet, poissons_ratio);
  const auto vertices = plate.xx.rows(), edges = plate.ee.rows();

  data::Points slopes = data::Points::Zero(edges, 3);
  std::vector<int> column(edges, 0);  // of the free edges; -1 where clamped
  for (const ClampedEdge& clamp : clamped) {
    int found = -1;
    for (int i = 0; i < int(edges); ++i)
      if (std::minmax(plate.edges[i].a, plate.edges[i].b) == std::minmax(clamp.vertex_a, clamp.vertex_b))
        found = i;
    if (found < 0)
      throw data::input_error("clamped edge",
                              std::to_string(clamp.vertex_a) + "-" + std::to_string(clamp.vertex_b),
                              "not an edge of the mesh");
    slopes.row(found) = clamp.slope;
    column[found] = -1;
  }
  Triplets select_free;
  int free = 0;
  for (int i = 0; i < int(edges); ++i)
    if (column[i] == 0) {
      column[i] = free;
      select_free.emplace_back(i, free++, 1.0);
    }
  const Sparse P = sparse(edges, free, select_free);
  const Sparse xe = plate.xe * P, ee = P.transpose() * plate.ee * P;

  Eigen::SimplicialLDLT<Sparse> factor(ee);
  if (factor.info() != Eigen::Success) throw data::input_error("mesh", "bending_model", "singular plate");
  // theta = -ee^-1 (ex x + fixed)
  CondensedPlate result;
  const Sparse ex = xe.transpose();
  result.stiffness = without_small_entries(Sparse(plate.xx - xe * Sparse(factor.solve(ex))), drop_tolerance);
  result.force = data::Points::Zero(vertices, 3);
  if (!clamped.empty()) {
    const data::Points fixed = P.transpose() * (plate.ee * slopes);
    const Eigen::MatrixXd response = factor.solve(Eigen::MatrixXd(fixed));
    result.force = xe * response - plate.xe * slopes;
    result.constant =
        0.5 * (slopes.cwiseProduct(plate.ee * slopes).sum() - fixed.cwiseProduct(response).sum());
  }
  return result;
}

Sparse plate_bending_stiffness(const Sheet& sheet, double poissons_ratio, double drop_tolerance) {
  return condensed_plate(sheet, poissons_ratio, {}, drop_tolerance).stiffness;
}

}  // namespace flash::sim
