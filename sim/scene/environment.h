#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <variant>
#include <vector>

#include "data/material.h"
#include "data/mesh.h"
#include "data/trajectory.h"

namespace flash::sim {

/// Half space below a plane.
struct Plane {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< [m]
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, out of the solid
};

/// Box with half extents [m], moved by a trajectory T_base_box (an empty trajectory stays at `pose`).
struct Box {
  Eigen::Vector3d half_extents = Eigen::Vector3d::Constant(0.01);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  data::Trajectory trajectory = {};
};

/// Solid cylinder without ends: a peg or a rail.
struct Cylinder {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< on the axis [m]
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  ///< unit
  double radius = 0.01;                             ///< [m]
};

struct Obstacle {
  std::variant<Plane, Box, Cylinder> shape;
  double friction = -1.0;  ///< Coulomb coefficient; below zero: the material's
};

/// Vertices that a gripper carries while from <= t < to. The gripper releases them after `to`. At activation
/// each held vertex goes, over `closing_time`, from where it is to T_base_gripper(t) * target.
struct Grasp {
  std::vector<int> vertices;
  data::Points targets;      ///< held positions in the gripper frame [m], one row a vertex;
                             ///< empty: the offsets found at activation are kept
  data::Trajectory gripper;  ///< T_base_gripper
  double from = 0.0;         ///< [s]
  double to = std::numeric_limits<double>::infinity();  ///< [s]
  double closing_time = 0.0;                            ///< [s]
};

/// A vertex held in some axes.
struct FixedVertex {
  int vertex;
  std::array<bool, 3> axes = {true, true, true};
  Eigen::Vector3d position;  ///< places of the held axes [m]
};

/// A constant force on a vertex.
struct Load {
  int vertex;
  Eigen::Vector3d force;  ///< [N]
};

struct State {
  double time = 0.0;        ///< [s]
  data::Points positions;   ///< [m]
  data::Points velocities;  ///< [m/s]
  std::vector<data::Points>
      grasp_offsets;  ///< held vertices in the gripper frame [m], a grasp each; empty: open
};

/// One simulated world: its own material, motion and state over a shared Sheet.
struct Environment {
  data::SheetMaterial material;
  Eigen::Vector3d gravity{0, 0, -9.81};  ///< [m/s^2]
  std::vector<Obstacle> obstacles;
  std::vector<Grasp> grasps;
  std::vector<FixedVertex> fixed;
  std::vector<Load> loads;
  State state;
};

}  // namespace flash::sim
