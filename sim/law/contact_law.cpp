#include "sim/law/contact_law.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace flash::sim {

using Eigen::Matrix3d;
using Eigen::Vector3d;

std::vector<double> solve_lcp(const std::vector<Vector3d>& normals, const std::vector<Vector3d>& directions,
                              const std::vector<double>& b) {
  const int count = static_cast<int>(normals.size());
  std::vector<double> best(normals.size(), 0.0);
  double largest = 0, best_violation = 0;
  for (const double each : b) {
    largest = std::max(largest, std::abs(each));
    best_violation = std::max(best_violation, each);
  }
  constexpr double parallel = 1e-6;  // sin^2 of 0.06 degrees, the angle between two faces
  const double rounding = 1e-12 * largest;
  // The solution uses one, two or three faces; in space no more are independent.
  const auto try_faces = [&](const std::array<int, 3>& faces, int size) {
    Matrix3d gram = Matrix3d::Identity();
    Vector3d right = Vector3d::Zero();
    for (int r = 0; r < size; ++r) {
      right[r] = b[faces[r]];
      for (int c = 0; c < size; ++c) gram(r, c) = normals[faces[r]].dot(directions[faces[c]]);
    }
    // Faces that are parallel give no unique force.
    if (std::abs(gram.determinant()) < parallel) return;
    const Vector3d x = gram.inverse() * right;
    if (x.head(size).minCoeff() < 0) return;
    Vector3d sum = Vector3d::Zero();
    for (int r = 0; r < size; ++r) sum += x[r] * directions[faces[r]];
    double violation = 0;
    for (int k = 0; k < count; ++k) violation = std::max(violation, b[k] - normals[k].dot(sum));
    if (violation >= best_violation - rounding) return;
    best_violation = violation;
    std::fill(best.begin(), best.end(), 0.0);
    for (int r = 0; r < size; ++r) best[faces[r]] = x[r];
  };
  for (int i = 0; i < count; ++i) {
    try_faces({i, 0, 0}, 1);
    for (int j = i + 1; j < count; ++j) {
      try_faces({i, j, 0}, 2);
      for (int k = j + 1; k < count; ++k) try_faces({i, j, k}, 3);
    }
  }
  return best;
}

}  // namespace flash::sim
