#include "sim/law/contact_law.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace flash::sim {

using Eigen::Matrix3d;
using Eigen::Vector3d;

std::vector<double> complementary(const std::vector<Vector3d>& normals,
                                  const std::vector<Vector3d>& directions, const std::vector<double>& b) {
  const int count = static_cast<int>(normals.size());
  std::vector<double> best(normals.size(), 0.0);
  double largest = 0, best_violation = 0;
  for (const double each : b) {
    largest = std::max(largest, std::abs(each));
    best_violation = std::max(best_violation, each);
  }
  const double rounding = 1e-12 * largest;
  // Of one, two or three faces; in space no more are independent.
  const auto try_faces = [&](const std::array<int, 3>& faces, int size) {
    Matrix3d gram = Matrix3d::Identity();
    Vector3d right = Vector3d::Zero();
    for (int r = 0; r < size; ++r) {
      right[r] = b[faces[r]];
      for (int c = 0; c < size; ++c) gram(r, c) = normals[faces[r]].dot(directions[faces[c]]);
    }
    // Faces that point the same way, or against each other.
    if (std::abs(gram.determinant()) < 1e-6) return;
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

namespace {

void set_forces(std::span<Touch> touches, const std::vector<size_t>& those,
                const std::vector<double>& forces) {
  for (Touch& touch : touches) {
    touch.holds = false;
    touch.normal_force = 0;
  }
  for (size_t k = 0; k < those.size(); ++k) {
    touches[those[k]].normal_force = forces[k];
    touches[those[k]].holds = forces[k] > 0;
  }
}

}  // namespace

void share_force(std::span<Touch> touches, const Vector3d& needed, bool (*eligible)(const Touch&)) {
  if (touches.size() == 1) {
    // Most sheets meet one table.
    Touch& touch = touches[0];
    touch.normal_force = eligible(touch) ? std::max(0.0, touch.normal.dot(needed)) : 0.0;
    touch.holds = touch.normal_force > 0;
    return;
  }
  std::vector<size_t> those;
  std::vector<Vector3d> normals;
  std::vector<double> along;
  for (size_t k = 0; k < touches.size(); ++k) {
    if (!eligible(touches[k])) continue;
    those.push_back(k);
    normals.push_back(touches[k].normal);
    along.push_back(touches[k].normal.dot(needed));
  }
  if (those.size() == 1)
    set_forces(touches, those, {std::max(0.0, along[0])});
  else
    set_forces(touches, those, complementary(normals, normals, along));
}

void share_force_rubbing(std::span<Touch> touches, const std::vector<double>& friction,
                         const Vector3d& needed, bool (*eligible)(const Touch&)) {
  std::vector<size_t> those;
  std::vector<Vector3d> normals, directions;
  std::vector<double> along;
  for (size_t k = 0; k < touches.size(); ++k) {
    if (!eligible(touches[k])) continue;
    those.push_back(k);
    normals.push_back(touches[k].normal);
    directions.push_back(touches[k].normal - friction[k] * touches[k].slip_direction);
    along.push_back(touches[k].normal.dot(needed));
  }
  set_forces(touches, those, complementary(normals, directions, along));
}

Matrix3d along_surfaces(std::span<const Touch> touches) {
  std::array<Vector3d, 3> normals;
  size_t count = 0;
  for (const Touch& touch : touches)
    if (touch.holds) normals[count++] = touch.normal;
  if (count == 0) return Matrix3d::Identity();
  if (count > 2) return Matrix3d::Zero();
  if (count == 1) return Matrix3d::Identity() - normals[0] * normals[0].transpose();
  const Vector3d edge = normals[0].cross(normals[1]).normalized();
  return edge * edge.transpose();
}

}  // namespace flash::sim
