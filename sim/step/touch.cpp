#include "sim/step/touch.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "sim/law/contact_law.h"

namespace flash::sim {

using Eigen::Matrix3d;
using Eigen::Vector3d;

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
    set_forces(touches, those, solve_lcp(normals, normals, along));
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
  set_forces(touches, those, solve_lcp(normals, directions, along));
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
