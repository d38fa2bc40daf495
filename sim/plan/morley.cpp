#include "sim/plan/morley.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "data/files/error.h"
#include "sim/plan/decaying_solution.h"

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

/// The unit vector t x N in the plane of an edge (see MorleyPlate).
Eigen::Vector2d normal_of(const Edge& e, const Eigen::Matrix2Xd& plane) {
  const Eigen::Vector2d t = (plane.col(e.b) - plane.col(e.a)).normalized();
  return {t.y(), -t.x()};
}

// Rows of T = -ee^-1 ex, the normal derivative of the free edges in terms of the positions, without their
// small entries. What is left of a row is moved by the least change that gives it `affine`: T times the
// places of the vertices in the plane.
Sparse slope_weights(const Sheet& sheet, const std::vector<Edge>& edges, const Eigen::Matrix2Xd& plane,
                     const Sparse& ee, const Sparse& ex, const Eigen::MatrixX2d& affine,
                     double drop_tolerance) {
  Eigen::VectorXd smallest(Eigen::Index(edges.size()));
  for (Eigen::Index i = 0; i < smallest.size(); ++i) {
    const Edge& e = edges[i];
    const double area = sheet.triangles[e.left].area + (e.right >= 0 ? sheet.triangles[e.right].area : 0.0);
    smallest[i] = std::sqrt(drop_tolerance) * (plane.col(e.a) - plane.col(e.b)).norm() / area;
  }
  Eigen::SparseMatrix<double, Eigen::RowMajor> T = decaying_solution(ee, -ex, smallest, plane);
  // Three vertices take the change below. Where a fourth has a small weight, it may lie on a stiff triangle.
  T.prune([&](Eigen::Index edge, Eigen::Index vertex, double weight) {
    return vertex != edges[edge].opposite_right || std::abs(weight) >= smallest[edge];
  });
  using Row = Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator;
  for (Eigen::Index i = 0; i < T.rows(); ++i) {
    const Eigen::Vector2d a = plane.col(edges[i].a), b = plane.col(edges[i].b);
    const double length = (b - a).norm();
    const auto from_midpoint = [&](Eigen::Index vertex) -> Eigen::Vector3d {
      const Eigen::Vector2d d = (plane.col(vertex) - 0.5 * (a + b)) / length;
      return {1.0, d.x(), d.y()};
    };
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    Eigen::Vector3d missing(0.0, affine(i, 0) / length, affine(i, 1) / length);
    for (Row it(T, i); it; ++it) {
      const Eigen::Vector3d d = from_midpoint(it.col());
      moments += d * d.transpose();
      missing -= it.value() * d;
    }
    const Eigen::Vector3d change = moments.ldlt().solve(missing);
    for (Row it(T, i); it; ++it) it.valueRef() += change.dot(from_midpoint(it.col()));
  }
  return T;
}

// Of deflections x^2, xy, y^2 and their sums: by how much of the least energy over all slopes that of the
// slopes T x is above it, at most. Such a deflection costs little, and its slopes grow with the distance: so
// far weights that are dropped count most here.
double excess_energy(const Sparse& xx, const Sparse& xe, const Sparse& ee,
                     const Eigen::SimplicialLDLT<Sparse>& factor, const Sparse& T,
                     const Eigen::Matrix2Xd& plane) {
  const Eigen::Matrix2Xd from_middle = plane.colwise() - plane.rowwise().mean();
  const auto x = from_middle.row(0).transpose().array(), y = from_middle.row(1).transpose().array();
  Eigen::MatrixX3d bent(plane.cols(), 3);
  bent << x * x, x * y, y * y;
  const Eigen::MatrixX3d slopes = -factor.solve(Eigen::MatrixX3d(xe.transpose() * bent)),
                         missing = T * bent - slopes;
  const Eigen::Matrix3d least = bent.transpose() * (xx * bent + xe * slopes),
                        more = missing.transpose() * (ee * missing);
  // One row of cells has the same y^2 everywhere, so that some of them cost nothing but rounding.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> modes(least);
  const Eigen::Vector3d& costs = modes.eigenvalues();  // ascending
  const auto counted = (costs.array() > 1e-9 * costs[2]).count();
  if (!(costs[2] > 0) || counted == 0) return 0.0;
  const Eigen::MatrixXd each =
      modes.eigenvectors().rightCols(counted) * costs.tail(counted).cwiseSqrt().cwiseInverse().asDiagonal();
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(each.transpose() * more * each)
      .eigenvalues()
      .maxCoeff();
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

  // Affine positions have the slopes n everywhere, by which they cost nothing. T x is for clamped edges of no
  // slope, which those next to them follow.
  const Eigen::Matrix2Xd plane = plane_of(sheet).coordinates;
  Eigen::MatrixX2d normals(edges, 2), affine(Eigen::Index(free.size()), 2);
  for (Eigen::Index i = 0; i < edges; ++i)
    normals.row(i) = is_clamped[i] ? normal_of(plate.edges[i], plane) : Eigen::Vector2d::Zero();
  for (Eigen::Index i = 0; i < affine.rows(); ++i) affine.row(i) = normal_of(free[i], plane);
  if (!clamped.empty()) affine += factor.solve(Eigen::MatrixX2d(P.transpose() * (plate.ee * normals)));

  // The energy at theta = T x + response: for the exact T the minimum over theta, for a truncated one above
  // it by the square of what was dropped.
  const Sparse T = slope_weights(sheet, free, plane, ee, ex, affine, drop_tolerance);
  const Sparse mixed = xe * T, quadratic = T.transpose() * Sparse(ee * T);
  CondensedPlate result;
  result.stiffness = plate.xx + mixed + Sparse(mixed.transpose()) + quadratic;
  result.excess = excess_energy(plate.xx, xe, ee, factor, T, plane);
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
  constexpr double most_excess = 0.01, least_tolerance = 1e-15;
  while (true) {
    CondensedPlate plate = condensed_plate(sheet, poissons_ratio, {}, drop_tolerance, weave);
    if (plate.excess <= most_excess || drop_tolerance < least_tolerance) return plate.stiffness;
    drop_tolerance /= 10;
  }
}

}  // namespace flash::sim
