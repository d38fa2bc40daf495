#include "data/meshing/flatten.h"

#include <Eigen/Geometry>
#include <Eigen/Sparse>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "data/files/error.h"
#include "data/meshing/surface_topology.h"

namespace flash::data {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Layout = Eigen::Matrix<double, Eigen::Dynamic, 2>;
using Corners = Eigen::Matrix<double, 2, 3>;  ///< a triangle in its own plane, one column a corner
using Sparse = Eigen::SparseMatrix<double>;

Corners in_its_plane(const Points& x, const Eigen::Vector3i& t) {
  const Eigen::Vector3d a = x.row(t[1]) - x.row(t[0]), b = x.row(t[2]) - x.row(t[0]);
  const double length = a.norm();
  Corners corners = Corners::Zero();
  corners(0, 1) = length;
  corners(0, 2) = a.dot(b) / length;
  corners(1, 2) = a.cross(b).norm() / length;
  return corners;
}

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Half the cotangent of the angle against each side; side k runs from corner k to the next one.
Eigen::Vector3d half_cotangents(const Corners& corners) {
  Eigen::Vector3d result;
  for (int k = 0; k < 3; ++k) {
    const Vector2d u = corners.col(k) - corners.col((k + 2) % 3),
                   v = corners.col((k + 1) % 3) - corners.col((k + 2) % 3);
    result[k] = u.dot(v) / (2 * std::abs(cross(u, v)));
  }
  return result;
}

/// Least-squares conformal: the Dirichlet energy less the area, with two vertices held at the distance that
/// they have in space.
Layout conformal(const TriangleMesh& mesh, const std::vector<Corners>& own, int first, int second) {
  const Eigen::Index n = mesh.vertices.rows();
  std::vector<Eigen::Triplet<double>> entries;
  const auto add = [&](Eigen::Index i, Eigen::Index k, double value) { entries.emplace_back(i, k, value); };
  for (Eigen::Index i = 0; i < mesh.triangles.rows(); ++i) {
    const Eigen::Vector3d weights = half_cotangents(own[std::size_t(i)]);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Index a = mesh.triangles(i, k), b = mesh.triangles(i, (k + 1) % 3);
      for (const Eigen::Index axis : {Eigen::Index(0), n}) {
        add(axis + a, axis + a, weights[k]);
        add(axis + b, axis + b, weights[k]);
        add(axis + a, axis + b, -weights[k]);
        add(axis + b, axis + a, -weights[k]);
      }
      // The area of a triangle is half the sum of x_a y_b - x_b y_a over its sides.
      add(a, n + b, -0.5);
      add(n + b, a, -0.5);
      add(b, n + a, 0.5);
      add(n + a, b, 0.5);
    }
  }
  Sparse energy(2 * n, 2 * n);
  energy.setFromTriplets(entries.begin(), entries.end());
  Eigen::VectorXd held = Eigen::VectorXd::Zero(2 * n);
  held[second] = (mesh.vertices.row(second) - mesh.vertices.row(first)).norm();
  Eigen::VectorXd right = -(energy * held);
  for (const Eigen::Index index : {Eigen::Index(first), n + first, Eigen::Index(second), n + second}) {
    right[index] = held[index];
    energy.prune([&](Eigen::Index i, Eigen::Index k, double) { return i != index && k != index; });
    energy.coeffRef(index, index) = 1;
  }
  const Eigen::SimplicialLDLT<Sparse> factor(energy);
  const Eigen::VectorXd solution = factor.solve(right);
  Layout layout(n, 2);
  layout << solution.head(n), solution.tail(n);
  return layout;
}

/// F of a triangle: from its own plane into the layout.
Matrix2d gradient(const Corners& own, const Layout& layout, const Eigen::Vector3i& t) {
  Matrix2d before, now;
  before << own.col(1) - own.col(0), own.col(2) - own.col(0);
  now << (layout.row(t[1]) - layout.row(t[0])).transpose(), (layout.row(t[2]) - layout.row(t[0])).transpose();
  return now * before.inverse();
}

/// The rotation nearest to F.
Matrix2d rotation_of(const Matrix2d& F) {
  const double c = F(0, 0) + F(1, 1), s = F(1, 0) - F(0, 1), length = std::hypot(c, s);
  if (length == 0) return Matrix2d::Identity();
  Matrix2d R;
  R << c / length, -s / length, s / length, c / length;
  return R;
}

/// Rotations of the triangles for the layout, the layout for the rotations, until no vertex moves farther
/// than `tolerance`.
void make_rigid(const TriangleMesh& mesh, const std::vector<Corners>& own, double tolerance, Layout& layout) {
  constexpr int most_rounds = 2000;
  const Eigen::Index n = mesh.vertices.rows();
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index i = 0; i < mesh.triangles.rows(); ++i) {
    const Eigen::Vector3d weights = half_cotangents(own[std::size_t(i)]);
    for (int k = 0; k < 3; ++k) {
      const int a = mesh.triangles(i, k), b = mesh.triangles(i, (k + 1) % 3);
      if (a != 0) entries.emplace_back(a, a, weights[k]);
      if (b != 0) entries.emplace_back(b, b, weights[k]);
      if (a != 0 && b != 0) {
        entries.emplace_back(a, b, -weights[k]);
        entries.emplace_back(b, a, -weights[k]);
      }
    }
  }
  entries.emplace_back(0, 0, 1.0);  // the first vertex stays at the origin
  Sparse laplacian(n, n);
  laplacian.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Sparse> factor(laplacian);
  layout.rowwise() -= Eigen::RowVector2d(layout.row(0));
  for (int round = 0; round < most_rounds; ++round) {
    Layout right = Layout::Zero(n, 2);
    for (Eigen::Index i = 0; i < mesh.triangles.rows(); ++i) {
      const Eigen::Vector3i t = mesh.triangles.row(i);
      const Corners& corners = own[std::size_t(i)];
      const Matrix2d R = rotation_of(gradient(corners, layout, t));
      const Eigen::Vector3d weights = half_cotangents(corners);
      for (int k = 0; k < 3; ++k) {
        const Eigen::RowVector2d side =
            weights[k] * (R * (corners.col((k + 1) % 3) - corners.col(k))).transpose();
        right.row(t[(k + 1) % 3]) += side;
        right.row(t[k]) -= side;
      }
    }
    right.row(0).setZero();
    const Layout next = factor.solve(right);
    const double motion = (next - layout).rowwise().norm().maxCoeff();
    layout = next;
    if (motion < tolerance) return;
  }
}

/// Corners of the convex hull, counter-clockwise (Andrew 1979).
std::vector<Vector2d> hull_of(const Layout& layout) {
  std::vector<Vector2d> points, hull;
  for (const auto& row : layout.rowwise()) points.emplace_back(row.transpose());
  std::sort(points.begin(), points.end(), [](const Vector2d& a, const Vector2d& b) {
    return std::pair(a.x(), a.y()) < std::pair(b.x(), b.y());
  });
  for (int half = 0; half < 2; ++half) {
    const std::size_t start = hull.size();
    for (const Vector2d& p : points) {
      while (hull.size() >= start + 2 && cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0)
        hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();  // where the other half begins
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

/// Turned and moved so that the least rectangle about it has its longer side along x and a corner at 0. A
/// side of that rectangle lies along one of the hull (Freeman and Shapira 1975).
void lay_straight(Layout& layout, double& width, double& height) {
  const std::vector<Vector2d> hull = hull_of(layout);
  double least = std::numeric_limits<double>::infinity();
  Matrix2d best = Matrix2d::Identity();
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Vector2d along = (hull[(i + 1) % hull.size()] - hull[i]).normalized(),
                   across(-along.y(), along.x());
    Vector2d low = Vector2d::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (const Vector2d& p : hull) {
      const Vector2d place(p.dot(along), p.dot(across));
      low = low.cwiseMin(place);
      high = high.cwiseMax(place);
    }
    const Vector2d sides = high - low;
    if (sides.prod() >= least) continue;
    least = sides.prod();
    if (sides[0] >= sides[1])
      best << along, across;
    else
      best << across, -along;
  }
  layout *= best;
  layout.rowwise() -= Eigen::RowVector2d(layout.colwise().minCoeff());
  width = layout.col(0).maxCoeff();
  height = layout.col(1).maxCoeff();
}

/// Strains of the edges and triangles that are turned over.
void measure(const TriangleMesh& mesh, const std::vector<Corners>& own, const Layout& layout,
             FlatShape& shape) {
  double sum = 0, total = 0;
  for (Eigen::Index i = 0; i < mesh.triangles.rows(); ++i) {
    const Eigen::Vector3i t = mesh.triangles.row(i);
    const double area = cross(own[std::size_t(i)].col(1), own[std::size_t(i)].col(2)) / 2;
    if (gradient(own[std::size_t(i)], layout, t).determinant() <= 0) ++shape.inverted;
    for (int k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      const double strain = std::abs(
          (mesh.vertices.row(a) - mesh.vertices.row(b)).norm() / (layout.row(a) - layout.row(b)).norm() - 1);
      shape.largest_strain = std::max(shape.largest_strain, strain);
      sum += area * strain * strain;
      total += area;
    }
  }
  shape.rms_strain = std::sqrt(sum / total);
}

/// The two vertices of the border that are farthest apart, nearly: each is farthest from the other.
std::array<int, 2> far_ends(const Points& x, const std::vector<int>& border) {
  const auto farthest = [&](int from) {
    return *std::max_element(border.begin(), border.end(), [&](int a, int b) {
      return (x.row(a) - x.row(from)).norm() < (x.row(b) - x.row(from)).norm();
    });
  };
  const int first = farthest(border[0]);
  return {first, farthest(first)};
}

}  // namespace

FlatShape flattened(const TriangleMesh& mesh, const std::string& source) {
  const SurfaceTopology topology = topology_of(mesh);
  if (topology.components != 1 || topology.borders.size() != 1 || topology.euler != 1)
    throw InputError(source + ": does not lie flat: found " + std::to_string(topology.components) +
                     " parts, " + std::to_string(topology.borders.size()) +
                     " borders and the Euler characteristic " + std::to_string(topology.euler) +
                     ", expected one disc: 1, 1 and 1");
  std::vector<Corners> own;
  for (const auto& t : mesh.triangles.rowwise()) own.push_back(in_its_plane(mesh.vertices, t));
  const auto [first, second] = far_ends(mesh.vertices, topology.borders[0]);
  Layout layout = conformal(mesh, own, first, second);
  double area = 0;
  for (const auto& t : mesh.triangles.rowwise())
    area += cross(layout.row(t[1]) - layout.row(t[0]), layout.row(t[2]) - layout.row(t[0])) / 2;
  if (area > 0) layout *= std::sqrt(area_of(mesh) / area);
  FlatShape shape;
  make_rigid(mesh, own, 1e-7 * std::sqrt(area_of(mesh)), layout);
  lay_straight(layout, shape.width, shape.height);
  measure(mesh, own, layout, shape);
  shape.vertices = Points::Zero(mesh.vertices.rows(), 3);
  shape.vertices.leftCols<2>() = layout;
  return shape;
}

}  // namespace flash::data
