#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "sim/step/contact_force.h"

namespace flash::sim {

/// What acts on a body as a whole.
struct Wrench {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< [N]
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();  ///< about the origin of the base frame [N m]
};

/// Sums of contacts over each body that they act on.
struct Resultants {
  std::vector<Wrench> bodies;     ///< on each body of the sheet
  std::vector<Wrench> obstacles;  ///< on each obstacle of the environment
};

/// Forces of a pair are opposite and equal. Their torques are where both feel them at one point; friction of
/// layers acts at two, the distance of the layers apart.
Resultants resultants_of(std::span<const ContactForce> contacts, std::size_t bodies, std::size_t obstacles);

}  // namespace flash::sim
