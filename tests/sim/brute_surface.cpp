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
    // The foot of the perpendicular, where it is within.
    const Vector3d across = (b - a).cross(c - a);
    const double area = across.squaredNorm();
    const double of_b = (point - a).cross(c - a).dot(across) / area,
                 of_c = (b - a).cross(point - a).dot(across) / area;
    if (of_b >= 0 && of_c >= 0 && of_b + of_c <= 1)
      nearest = std::min(nearest, std::abs((point - a).dot(across)) / std::sqrt(area));
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

std::vector<BruteCrossing> brute_crossings(const data::TriangleMesh& mesh, const Vector3d& from,
                                           const Vector3d& to) {
  std::vector<BruteCrossing> crossings;
  for (const auto& t : mesh.triangles.rowwise()) {
    const Vector3d a = mesh.vertices.row(t[0]), b = mesh.vertices.row(t[1]), c = mesh.vertices.row(t[2]);
    const Vector3d normal = (b - a).cross(c - a).normalized();
    const double before = normal.dot(from - a), after = normal.dot(to - a);
    if (before == 0 ? after == 0 : before * after > 0) continue;
    Eigen::Matrix3d system;
    system << to - from, a - b, a - c;
    const Vector3d x = system.fullPivLu().solve(a - from);
    if (x[0] >= 0 && x[0] <= 1 && x[1] >= 0 && x[2] >= 0 && x[1] + x[2] <= 1)
      crossings.push_back({x[0], normal});
  }
  std::sort(crossings.begin(), crossings.end(),
            [](const BruteCrossing& a, const BruteCrossing& b) { return a.share < b.share; });
  return crossings;
}

}  // namespace flash::sim
