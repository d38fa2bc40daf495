#include "sim/step/resultants.h"

#include <Eigen/Geometry>

namespace flash::sim {

using Eigen::Vector3d;

namespace {

void add(const Vector3d& force, const Vector3d& point, const Vector3d& couple, Wrench& wrench) {
  wrench.force += force;
  wrench.torque += point.cross(force) + couple;
}

}  // namespace

Resultants resultants_of(std::span<const ContactForce> contacts, std::size_t bodies, std::size_t obstacles) {
  Resultants sums{std::vector<Wrench>(bodies), std::vector<Wrench>(obstacles)};
  for (const ContactForce& contact : contacts) {
    std::vector<Wrench>& others = contact.kind == ContactKind::vertex_obstacle ? sums.obstacles : sums.bodies;
    add(contact.force(), contact.point, contact.couple, sums.bodies[static_cast<std::size_t>(contact.body)]);
    add(-contact.force(), contact.other_point, -contact.couple,
        others[static_cast<std::size_t>(contact.other)]);
  }
  return sums;
}

}  // namespace flash::sim
