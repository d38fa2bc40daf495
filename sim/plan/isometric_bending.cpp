#include "sim/plan/isometric_bending.h"

#include <Eigen/Geometry>
#include <vector>

#include "sim/plan/edge.h"

namespace flash::sim {

Eigen::SparseMatrix<double> isometric_bending_stiffness(const Sheet& sheet) {
  const auto at = [&](int vertex) -> Eigen::Vector3d { return sheet.rest.vertices.row(vertex); };
  // Cotangent of the angle between the edge out of `corner` and another side.
  const auto cotangent = [](const Eigen::Vector3d& edge, const Eigen::Vector3d& side) {
    return edge.dot(side) / edge.cross(side).norm();
  };
  std::vector<Eigen::Triplet<double>> entries;
  for (const Edge& e : sheet_edges(sheet)) {
    if (e.right < 0) continue;
    const Eigen::Vector3d a = at(e.a), b = at(e.b), c = at(e.opposite_left), d = at(e.opposite_right);
    const double left_a = cotangent(b - a, c - a), left_b = cotangent(a - b, c - b);
    const double right_a = cotangent(b - a, d - a), right_b = cotangent(a - b, d - b);
    const int vertices[] = {e.a, e.b, e.opposite_left, e.opposite_right};
    const double stencil[] = {left_b + right_b, left_a + right_a, -(left_a + left_b), -(right_a + right_b)};
    const RestTriangle &left = sheet.triangles[e.left], &right = sheet.triangles[e.right];
    // A stiff triangle leaves all bending to the other.
    const double area = left.stiff == right.stiff ? left.area + right.area
                        : left.stiff              ? right.area
                                                  : left.area;
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        entries.emplace_back(vertices[i], vertices[j], stencil[i] * stencil[j] / area);
  }
  const auto n = sheet.rest.vertices.rows();
  Eigen::SparseMatrix<double> stiffness(n, n);
  stiffness.setFromTriplets(entries.begin(), entries.end());
  return stiffness;
}

}  // namespace flash::sim
