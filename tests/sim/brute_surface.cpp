#include "tests/sim/brute_surface.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

namespace flash::sim {

using Eigen::Vector3d;

namespace {

double distance_to_segment(const Vector3d& a, const Vector3d& b, const Vector3d& p) {
  const double share = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (p - a - share * (b - a)).norm();
}

}  // namespace

double brute_distance(const data::TriangleMesh& mesh, const Vector3d& point) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& t : mesh.triangles.rowwise()) {
    const Vector3d a = mesh.vertices.row(t[0]), b = mesh.vertices.row(t[1]), c = mesh.vertices.row(t[2]);
    // The foot of the perpendicular by least squares, where it is within.
    Eigen::Matrix<double, 3, 2> sides;
    sides << b - a, c - a;
    const Eigen::Vector2d weights = sides.colPivHouseholderQr().solve(point - a);
    if (weights.minCoeff() >= 0 && weights.sum() <= 1)
      nearest = std::min(nearest, (point - a - sides * weights).norm());
    nearest = std::min({nearest, distance_to_segment(a, b, point), distance_to_segment(b, c, point),
                        distance_to_segment(c, a, point)});
  }
  return nearest;
}

double brute_winding(const data::TriangleMesh& mesh, const Vector3d& point) {
  double angle = 0;
  for (const auto& t : mesh.triangles.rowwise()) {
    const Vector3d a = mesh.vertices.row(t[0]).transpose() - point,
                   b = mesh.vertices.row(t[1]).transpose() - point,
                   c = mesh.vertices.row(t[2]).transpose() - point;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    angle += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return angle / (4 * M_PI);
}

std::vector<double> brute_crossings(const data::TriangleMesh& mesh, const Vector3d& from,
                                    const Vector3d& to) {
  std::vector<double> shares;
  for (const auto& t : mesh.triangles.rowwise()) {
    const Vector3d a = mesh.vertices.row(t[0]), b = mesh.vertices.row(t[1]), c = mesh.vertices.row(t[2]);
    Eigen::Matrix3d system;
    system << to - from, a - b, a - c;
    if (std::abs(system.determinant()) < 1e-300) continue;
    const Vector3d x = system.fullPivLu().solve(a - from);
    if (x[0] >= 0 && x[0] <= 1 && x[1] >= 0 && x[2] >= 0 && x[1] + x[2] <= 1) shares.push_back(x[0]);
  }
  std::sort(shares.begin(), shares.end());
  return shares;
}

}  // namespace flash::sim
