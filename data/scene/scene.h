#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "data/asset/material.h"
#include "data/mesh/mesh.h"
#include "data/motion/trajectory.h"

namespace flash::data {

/// Solver settings under the names of the file.
struct SceneSolver {
  std::string linear_solver = "SPARSE_CHOLESKY";  ///< linearsolver.type, e.g. SPARSE_INVERSE_CUDA
  /// constraintsolver.type: automatic, NonSmoothNewton (full metric) or LiteNonSmoothNewton (inertia), maybe
  /// with _CUDA
  std::string constraint_solver = "automatic";
  std::string constraint_linear_solver = "DENSE_CHOLESKY_EIGEN";  ///< constraintsolver.linearsolver
  double max_force = 1e10;                                        ///< constraintsolver.maxforce [N]
  int constraint_iterations = 10;                                 ///< constraintsolver.iterations
  double constraint_tolerance = 1e-9;                             ///< constraintsolver.tolerance [m]
  std::string integrator = "newton";                              ///< solver.type: newton or projective
  int max_iterations = 60;                                        ///< solver.iterations a step
  double tolerance = 1e-3;                                        ///< solver.tolerance on |r| / |M g|
  double exit_speed = 1.0;  ///< solver.exit_speed of what starts inside an obstacle, at most [m/s]
};

struct ScenePlane {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< [m]
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, out of the solid
};

struct SceneBox {
  Eigen::Vector3d size = Eigen::Vector3d::Constant(0.02);  ///< full edges [m]
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< T_base_box
  Trajectory trajectory;                                   ///< T_base_box(t); empty: stays at `pose`
};

struct SceneCylinder {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< on the axis [m]
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  ///< unit
  double radius = 0.01;                             ///< [m]
};

/// All within `radius` of a stretch of an axis. Shape `sphere` is one without length.
struct SceneCapsule {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< in the middle of the stretch [m]
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  ///< unit
  double half_length = 0.0;                         ///< of the stretch [m]
  double radius = 0.01;                             ///< [m]
  Trajectory trajectory;                            ///< of a frame in which it stands; empty: it stays
};

/// A surface of triangles.
struct SceneMesh {
  std::string file;                                        ///< resolved path
  double scale = 1.0;                                      ///< of its coordinates, to metres
  std::optional<double> margin;                            ///< how far off the triangles it is met [m]
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< T_base_mesh
  Trajectory trajectory;                                   ///< T_base_mesh(t); empty: stays at `pose`
};

/// Rigid surface. `planecollisions` become obstacles like any other.
struct SceneObstacle {
  std::string name;
  std::variant<ScenePlane, SceneBox, SceneCylinder, SceneCapsule, SceneMesh> shape;
  std::optional<double> friction;  ///< empty: the material's
};

/// Vertices held in some axes, all for the whole run.
struct SceneFixed {
  std::string name = "fixed";  ///< under which their support's force is written
  std::vector<int> vertices;
  bool all = false;                               ///< every vertex of the object; `vertices` is empty then
  std::array<bool, 3> axes = {true, true, true};  ///< "x", "xy", ...: a roller fixes one axis
  Points positions;                               ///< one row a vertex [m]; empty: where they start
  double over = 0.0;    ///< in which they move from their start to `positions`, evenly [s]
  bool slopes = false;  ///< the sheet keeps its slope at them too
};

/// Vertices moved rigidly: x(t) = T(t) T(from)^-1 x(from).
struct ScenePrescribed {
  std::string name = "prescribed";  ///< under which the force on them is written
  std::vector<int> vertices;
  Trajectory trajectory;  ///< a TUM file, or keyframes {t, translation, rotation_xyzw}
  double from = 0.0;      ///< [s]
  double to = std::numeric_limits<double>::infinity();  ///< [s]
  bool slopes = false;                                  ///< as SceneFixed
};

/// The same constant force on each of some vertices (a hung mass arrives here as mass times gravity, shared
/// evenly), or the same mass.
struct SceneLoad {
  std::vector<int> vertices;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< on each vertex [N]
  double attached_mass = 0;                         ///< at each vertex, that moves with it [kg]
};

struct SceneObject {
  std::string name;
  std::string asset;  ///< resolved path of the asset file
  Eigen::Isometry3d base_from_object =
      Eigen::Isometry3d::Identity();  ///< start.T_base_object, after the asset's own transformation
  std::string start_mesh;             ///< resolved path of the start positions, or empty
  Eigen::Vector3d start_velocity = Eigen::Vector3d::Zero();  ///< of every vertex [m/s]
  std::vector<SceneFixed> fixed;
  std::vector<ScenePrescribed> prescribed;
  std::vector<SceneLoad> loads;
};

/// While from <= t < to the effector holds the vertices of `object` within `threshold` of its box at `from`.
struct SceneGrasp {
  std::string object;
  double from = 0.0;                                    ///< [s]
  double to = std::numeric_limits<double>::infinity();  ///< [s]
  double threshold = 0.01;                              ///< [m]
  bool zero_length =
      false;  ///< true: held vertices are pulled to the effector's origin; false: they keep their offsets
  double closing_time = 0.0;  ///< zero_length: over which they are pulled [s]
  bool slopes = false;        ///< as SceneFixed
};

struct SceneEndEffector {
  std::string name;
  Eigen::Vector3d size = Eigen::Vector3d::Constant(0.02);  ///< full edges of its box [m]
  Trajectory trajectory;                                   ///< T_base_effector(t)
  bool collides = false;                                   ///< its box is an obstacle too
  std::optional<double> friction;
  std::vector<SceneGrasp> grasps;
};

/// How objects meet themselves and each other.
struct SceneSelfContact {
  double thickness = 1e-3;   ///< distance from which on layers feel each other [m]
  double friction = 0.3;     ///< Coulomb coefficient of layer on layer
  double pressure = 2500.0;  ///< that presses layers to 0.53 of the thickness [Pa]
};

/// Coulomb coefficient of an object on an obstacle, or on an end effector that collides.
struct ScenePairFriction {
  std::string object, other;
  double friction = 0.0;
};

/// A scene as its file says it: the published one (no schema) or "flash-scene/1".
struct Scene {
  std::string source;
  std::string name;
  double time_step = 0.01;               ///< h [s]
  int steps = 100;                       ///< "steps", or "duration" over the time step; at most 1e6
  bool steps_by_default = true;          ///< the file names neither
  Eigen::Vector3d gravity{0, -9.81, 0};  ///< [m/s^2]
  SceneSolver solver;
  std::optional<BendingModel> bending_model;  ///< overrides the assets'
  std::vector<SceneObject> objects;
  std::vector<SceneObstacle> obstacles;
  std::vector<SceneEndEffector> end_effectors;
  std::vector<ScenePairFriction> pair_friction;
  std::optional<SceneSelfContact> self_contact;  ///< empty: objects pass through themselves and each other
  std::vector<double> keyframe_times;            ///< to write [s]; empty: every step
  /// Quasistatic: every step starts without velocity, and the run ends at rest, when no vertex moves farther
  /// than this in a step and all supports have arrived [m].
  std::optional<double> rest_motion;
  std::vector<std::string> notices;
};

/// Steps of one simulation at most: what asks for more has another unit, or another clock.
inline constexpr int max_steps = 1'000'000;

/// The longest step of a simulation [s].
inline constexpr double max_time_step = 1;

/// The shortest [s]. A place a metre away is known to 1e-16 m, which over h^2 is an acceleration: at 1e-7 s a
/// thousandth of the Earth's, the tolerance of a step; at 1e-8 s a tenth, and no step can be solved.
inline constexpr double min_time_step = 1e-7;

/// How many steps of `time_step` a run of `duration` takes [s]; -1 where they are more than max_steps.
int steps_of(double duration, double time_step);

/// Throws InputError naming file, field, found and expected; unknown fields name the nearest known one.
/// Vertex indices are not compared with the meshes, which are not loaded.
Scene load_scene(const std::string& path);

/// Whether a solver of the file is named ..._CUDA.
bool asks_for_cuda(const SceneSolver& solver);

/// The coefficient of `object` on `other`: the pair's, else the other body's, else empty (the material's).
std::optional<double> friction_between(const Scene& scene, const std::string& object,
                                       const std::string& other);

}  // namespace flash::data
