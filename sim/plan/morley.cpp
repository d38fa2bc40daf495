#include "sim/plan/morley.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
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

/// The plane of the rest shape, seen from the side of its normals.
struct Plane {
  Eigen::Vector3d normal, u, v;
  Eigen::Matrix2Xd coordinates;  ///< of the vertices
  Eigen::Vector3d x;             ///< axis of the mesh
};

Plane plane_of(const Sheet& sheet) {
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
  const RestTriangle& first = sheet.triangles.front();
  const Eigen::Vector3d edge = at(first.vertices[1]) - at(first.vertices[0]), along = edge.normalized(),
                        across = edge.cross(at(first.vertices[2]) - at(first.vertices[0]))
                                     .cross(along)
                                     .normalized();
  return {normal, u, v, plane, first.x_axis.x() * along + first.x_axis.y() * across};
}

/// The rigidity of D_1 = 1 on the curvatures (k11, k22, k12) along u and v.
Eigen::Matrix3d plate_rigidity(double poissons_ratio, const data::Weave& weave, const Plane& plane) {
  const double weft = weave.bending_ratio, mean = std::sqrt(weft);
  Eigen::Matrix3d rigidity;
  rigidity << 1, poissons_ratio * mean, 0, poissons_ratio * mean, weft, 0, 0, 0,
      2 * (1 - poissons_ratio) * weave.twisting_ratio * mean;
  if (!weave.is_of_bending()) return rigidity;
  const double angle = std::atan2(plane.x.dot(plane.v), plane.x.dot(plane.u)) + weave.warp_direction;
  const double c = std::cos(angle), s = std::sin(angle);
  Eigen::Matrix3d turn;  // curvatures along warp and weft from those along u and v
  turn << c * c, s * s, 2 * c * s, s * s, c * c, -2 * c * s, -c * s, c * s, c * c - s * s;
  return turn.transpose() * rigidity * turn;
}

// x <- -matrix^-1 x for many right-hand sides at once: a row of x is contiguous, so the loops run over
// vectors.
using Block = Eigen::Matrix<double, Eigen::Dynamic, 32, Eigen::RowMajor>;

void solve_negative(const Eigen::SimplicialLDLT<Sparse>& factor, Block& x) {
  const Sparse& L = factor.matrixL().nestedExpression();
  Block y = factor.permutationP() * x;
  for (int j = 0; j < L.cols(); ++j)
    for (Sparse::InnerIterator it(L, j); it; ++it)
      if (it.row() > j) y.row(it.row()).noalias() -= it.value() * y.row(j);
  y.array().colwise() /= -factor.vectorD().array();
  for (int j = int(L.cols()) - 1; j >= 0; --j)
    for (Sparse::InnerIterator it(L, j); it; ++it)
      if (it.row() > j) y.row(j).noalias() -= it.value() * y.row(it.row());
  x = factor.permutationP().transpose() * y;
}

// Rows of T = -ee^-1 ex, the normal derivative of the free edges in terms of the positions, without their
// small entries. What is left of a row is moved by the least change that keeps its values for affine
// positions.
Sparse slope_weights(const Sheet& sheet, const std::vector<Edge>& edges, const Eigen::Matrix2Xd& plane,
                     const Eigen::SimplicialLDLT<Sparse>& factor, const Sparse& ex, double drop_tolerance) {
  struct Weight {
    int vertex;
    double value;
  };
  std::vector<std::vector<Weight>> rows(edges.size());
  Eigen::Matrix3Xd affine = Eigen::Matrix3Xd::Zero(3, Eigen::Index(edges.size()));  // T (1, x, y)
  std::vector<double> smallest(edges.size());
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const Edge& e = edges[i];
    const double area = sheet.triangles[e.left].area + (e.right >= 0 ? sheet.triangles[e.right].area : 0.0);
    smallest[i] = std::sqrt(drop_tolerance) * (plane.col(e.a) - plane.col(e.b)).norm() / area;
  }
  const auto from_midpoint = [&](const Edge& e, int vertex) -> Eigen::Vector3d {
    const Eigen::Vector2d length = plane.col(e.b) - plane.col(e.a);
    const Eigen::Vector2d d = (plane.col(vertex) - 0.5 * (plane.col(e.a) + plane.col(e.b))) / length.norm();
    return {1.0, d.x(), d.y()};
  };
  Block block(ex.rows(), Block::ColsAtCompileTime);
  for (int first = 0; first < ex.cols(); first += int(block.cols())) {
    const int count = std::min<int>(int(block.cols()), int(ex.cols()) - first);
    block.setZero();
    for (int j = 0; j < count; ++j)
      for (Sparse::InnerIterator it(ex, first + j); it; ++it) block(it.row(), j) = it.value();
    solve_negative(factor, block);
    for (std::size_t i = 0; i < edges.size(); ++i) {
      const Edge& e = edges[i];
      for (int j = 0; j < count; ++j) {
        const int vertex = first + j;
        const double value = block(Eigen::Index(i), j);
        if (std::abs(value) > 1e-12 * smallest[i])
          affine.col(Eigen::Index(i)) += value * from_midpoint(e, vertex);
        if (std::abs(value) >= smallest[i] || vertex == e.a || vertex == e.b || vertex == e.opposite_left)
          rows[i].push_back({vertex, value});
      }
    }
  }
  Triplets entries;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    Eigen::Vector3d missing = affine.col(Eigen::Index(i));
    for (const Weight& w : rows[i]) {
      const Eigen::Vector3d d = from_midpoint(edges[i], w.vertex);
      moments += d * d.transpose();
      missing -= w.value * d;
    }
    const Eigen::Vector3d change = moments.ldlt().solve(missing);
    for (const Weight& w : rows[i])
      entries.emplace_back(int(i), w.vertex, w.value + change.dot(from_midpoint(edges[i], w.vertex)));
  }
  return sparse(ex.rows(), ex.cols(), entries);
}

}  // namespace

MorleyPlate morley_plate(const Sheet& sheet, double poissons_ratio, const data::Weave& weave) {
  if (!(poissons_ratio > -1 && poissons_ratio < 1))
    throw data::input_error("material", "poisson",
                            std::to_string(poissons_ratio) + ", expected within (-1, 1)");
  const Plane rest = plane_of(sheet);
  const Eigen::Matrix2Xd& plane = rest.coordinates;
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

  const Eigen::Matrix3d rigidity = plate_rigidity(poissons_ratio, weave, rest);
  Triplets xx, xe, ee;
  constexpr double kStiff = 1e4;  // times the rigidity: its slopes follow its vertices to that share
  for (std::size_t t = 0; t < sheet.triangles.size(); ++t) {
    const RestTriangle& triangle = sheet.triangles[t];
    const double area = triangle.area / (triangle.stiff ? kStiff : 1.0);
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
    const Eigen::Matrix3d element_xx = by_vertex.transpose() * rigidity * by_vertex / area;
    const Eigen::Matrix3d element_xe = by_vertex.transpose() * rigidity * by_edge / area;
    const Eigen::Matrix3d element_ee = by_edge.transpose() * rigidity * by_edge / area;
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
                               const std::vector<ClampedEdge>& clamped, double drop_tolerance,
                               const data::Weave& weave) {
  const MorleyPlate plate = morley_plate(sheet, poissons_ratio, weave);
  const auto vertices = plate.xx.rows(), edges = plate.ee.rows();

  data::Points slopes = data::Points::Zero(edges, 3);
  std::vector<bool> is_clamped(edges, false);
  for (const ClampedEdge& clamp : clamped) {
    const auto same = [&](const Edge& e) {
      return std::minmax(e.a, e.b) == std::minmax(clamp.vertex_a, clamp.vertex_b);
    };
    const auto found = std::find_if(plate.edges.begin(), plate.edges.end(), same) - plate.edges.begin();
    if (found == edges)
      throw data::input_error("clamped edge",
                              std::to_string(clamp.vertex_a) + "-" + std::to_string(clamp.vertex_b),
                              "not an edge of the mesh");
    slopes.row(found) = clamp.slope;
    is_clamped[found] = true;
  }
  std::vector<Edge> free;
  Triplets select;
  for (int i = 0; i < int(edges); ++i)
    if (!is_clamped[i]) {
      select.emplace_back(i, int(free.size()), 1.0);
      free.push_back(plate.edges[i]);
    }
  const Sparse P = sparse(edges, Eigen::Index(free.size()), select);
  const Sparse xe = plate.xe * P, ex = xe.transpose(), ee = P.transpose() * plate.ee * P;
  const Eigen::SimplicialLDLT<Sparse> factor(ee);
  if (factor.info() != Eigen::Success) throw data::input_error("mesh", "bending_model", "singular plate");

  // The energy at theta = T x + response: for the exact T the minimum over theta, for a truncated one above
  // it by the square of what was dropped.
  const Sparse T = slope_weights(sheet, free, plane_of(sheet).coordinates, factor, ex, drop_tolerance);
  const Sparse mixed = xe * T, quadratic = T.transpose() * Sparse(ee * T);
  CondensedPlate result;
  result.stiffness = plate.xx + mixed + Sparse(mixed.transpose()) + quadratic;
  result.force = data::Points::Zero(vertices, 3);
  if (!clamped.empty()) {
    const Eigen::MatrixXd fixed = P.transpose() * (plate.ee * slopes), response = -factor.solve(fixed);
    result.force = -(xe * response + plate.xe * slopes);
    result.constant =
        0.5 * (slopes.cwiseProduct(plate.ee * slopes).sum() + fixed.cwiseProduct(response).sum());
  }
  return result;
}

Sparse plate_bending_stiffness(const Sheet& sheet, double poissons_ratio, double drop_tolerance,
                               const data::Weave& weave) {
  return condensed_plate(sheet, poissons_ratio, {}, drop_tolerance, weave).stiffness;
}

}  // namespace flash::sim
