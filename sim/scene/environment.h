#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "data/asset/material.h"
#include "data/files/error.h"
#include "data/mesh/mesh.h"
#include "sim/scene/hold.h"
#include "sim/scene/schedule.h"

namespace flash::sim {

struct SurfaceMesh;

/// Half space below a plane.
struct Plane {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< [m]
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, out of the solid
};

struct Box {
  Eigen::Vector3d half_extents = Eigen::Vector3d::Constant(0.01);  ///< [m]
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
};

/// Solid cylinder without ends: a peg or a rail.
struct Cylinder {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< on the axis [m]
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  ///< unit
  double radius = 0.01;                             ///< [m]
};

/// All within `radius` of a stretch of the axis: a finger. Without length it is a sphere.
struct Capsule {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();   ///< unit
  double half_length = 0.0;                          ///< of the stretch of the axis [m]
  double radius = 0.01;                              ///< [m]
};

/// A surface of triangles (sim/law/surface_mesh), shared by all environments that meet it. A closed one is
/// the surface of a solid. An open one is met on both sides.
struct Mesh {
  std::shared_ptr<const SurfaceMesh> surface;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  double margin = 0.0;  ///< how far off the triangles it is met; above 0 where it is open [m]
};

/// A rigid shape that a sheet meets.
struct Obstacle {
  std::variant<Plane, Box, Cylinder, Capsule, Mesh> shape = {};
  std::vector<double> friction =
      {};                  ///< Coulomb coefficient on each body; missing or below zero: the material's
  std::string name = {};   ///< under which the force is told
  int frame = base_frame;  ///< of the schedule, in which the shape stands
};

/// A constant force on a vertex.
struct Load {
  int vertex;
  Eigen::Vector3d force;  ///< [N]
};

/// A weight that is fixed to a vertex and moves with it.
struct PointMass {
  int vertex;
  double mass;  ///< [kg]
};

/// How the surface of the sheets meets itself.
struct SelfContact {
  double thickness = 1e-3;   ///< distance from which on layers feel each other [m]
  double friction = 0.3;     ///< Coulomb coefficient of layer on layer
  double pressure = 2500.0;  ///< that presses layers to 0.53 of the thickness [Pa]

  bool operator==(const SelfContact&) const = default;
};

/// Bristles of the friction between two features of a surface, by their vertices: a vertex and the three of a
/// face, or those of two edges.
struct PairBristle {
  std::array<int, 4> vertices{};
  bool edges = false;
  Eigen::Vector3d share = Eigen::Vector3d::Zero();  ///< as State::bristles, of the first on the second
};

struct State {
  double time = 0.0;        ///< [s]
  data::Points positions;   ///< [m]
  data::Points velocities;  ///< [m/s]
  /// Deflection of the bristles of friction, as a share of that at which they slide: a vector whose length is
  /// 1 at most, against the friction force. A row for each vertex on the first obstacle, then on the next.
  /// None: zero.
  data::Points bristles = {};
  std::vector<PairBristle> pair_bristles = {};  ///< of features that touch, ascending
  std::vector<HeldVertices> held;               ///< by each hold of the environment
  std::vector<double> rest_angles = {};         ///< of each hinge of the plan, once one has yielded [rad]
};

/// One simulated world: its own materials, motion and state over a shared Sheet.
struct Environment {
  std::vector<data::SheetMaterial> materials = {{}};  ///< of each body; those of solids are not read
  std::map<int, data::SolidMaterial> solids = {};     ///< of each body that is a solid, by its number
  Eigen::Vector3d gravity{0, 0, -9.81};               ///< [m/s^2]
  std::vector<Obstacle> obstacles;
  std::vector<Hold> holds;
  std::vector<Load> loads;
  std::vector<PointMass> point_masses = {};
  std::optional<SelfContact> self_contact = {};  ///< none: the surface passes through itself
  std::shared_ptr<const Schedule>
      schedule;  ///< of the frames that holds and obstacles name; none: all at rest
  State state;
};

/// Coulomb coefficient of an obstacle on a body whose material has that `friction`.
double friction_on(const Obstacle& obstacle, int body, double friction);

/// Coulomb coefficient of the material of a body.
double friction_of(const Environment& environment, int body);

/// Coulomb coefficient between an obstacle and the vertices of a body.
double friction_between(const Environment& environment, const Obstacle& obstacle, int body);

/// Pose of a frame of the environment's schedule at `time` [s]; that of the base frame is the identity.
Eigen::Isometry3d frame_pose(const Environment& environment, int frame, double time);

/// A reach had no vertex in it; the message has the distance of the nearest.
struct MissedGrasp : data::InputError {
  using data::InputError::InputError;
};

/// Whether a hold with a reach would take a vertex where the environment stands.
bool has_vertex_in_reach(const Environment& environment, const Hold& hold);

/// Closes and opens the holds for the step that ends at `time` [s]: a hold acts in the steps whose middle
/// lies between its `from` and `to`, so that one that follows another leaves no step out. One that closes
/// stores in environment.state.held which vertices it takes and where they are in its frame; one that opens
/// forgets them. Throws MissedGrasp where a reach has no vertex in it, and data::InputError as
/// check_stiffness does.
void update_holds(Environment& environment, double time);

/// Whether nothing is still to come: every hold has closed, has its vertices at their targets and does not
/// open any more, and every frame of the schedule has reached its last pose.
bool motion_is_over(const Environment& environment);

}  // namespace flash::sim
