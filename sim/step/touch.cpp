#include "sim/step/touch.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "sim/law/contact_law.h"
#include "sim/step/moving_obstacles.h"

namespace flash::sim {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

/// The eligible touches of a vertex as columns of a complementarity problem.
struct Surfaces {
  std::vector<size_t> those;
  std::vector<Vector3<double>> normals, directions;
  std::vector<double> along;  ///< of the needed force [N]

  Surfaces(std::span<const Touch> touches, const Vector3d& needed, bool (*eligible)(const Touch&)) {
    for (size_t k = 0; k < touches.size(); ++k) {
      if (!eligible(touches[k])) continue;
      those.push_back(k);
      normals.push_back(vector3(touches[k].normal));
      along.push_back(touches[k].normal.dot(needed));
    }
    directions = normals;
  }
};

void set_forces(const Surfaces& surfaces, std::span<Touch> touches) {
  std::vector<double> forces(surfaces.those.size());
  solve_lcp(static_cast<int>(forces.size()), surfaces.normals.data(), surfaces.directions.data(),
            surfaces.along.data(), forces.data());
  for (Touch& touch : touches) {
    touch.holds = false;
    touch.normal_force = 0;
  }
  for (size_t k = 0; k < forces.size(); ++k) {
    Touch& touch = touches[surfaces.those[k]];
    touch.normal_force = forces[k];
    touch.holds = forces[k] > 0;
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
  set_forces(Surfaces(touches, needed, eligible), touches);
}

void share_force_rubbing(std::span<Touch> touches, const Vector3d& needed, bool (*eligible)(const Touch&)) {
  Surfaces surfaces(touches, needed, eligible);
  for (size_t k = 0; k < surfaces.those.size(); ++k) {
    const Touch& touch = touches[surfaces.those[k]];
    surfaces.directions[k] = surfaces.normals[k] - touch.friction_coefficient * vector3(touch.slip_direction);
  }
  set_forces(surfaces, touches);
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
