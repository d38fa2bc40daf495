#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>

namespace flash::sim {

/// A box that code moves, and not a schedule. When it closes it takes the vertices within its reach, and none
/// where there is none. When it opens it lets them go.
struct EndEffector {
  std::string name = {};
  Eigen::Vector3d half_extents = Eigen::Vector3d::Constant(0.01);  ///< of the box [m]
  double threshold = 0.01;              ///< how far off the box it takes vertices [m]
  bool collides = true;                 ///< its box is an obstacle too
  std::optional<double> friction = {};  ///< of the box; empty: the materials'
};

/// Where it is found in every environment that has it.
struct EndEffectorNumbers {
  int frame;  ///< of the schedule
  int hold;
  int obstacle;  ///< -1: it does not collide
};

}  // namespace flash::sim
