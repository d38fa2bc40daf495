#pragma once
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "data/mesh/mesh.h"

namespace flash::sim {

/// The frame that never moves, beside those of a schedule.
inline constexpr int base_frame = -1;

/// The vertices within `threshold` of a box about the origin of a frame: what an open end effector can take.
struct Reach {
  std::string object = {};                  ///< name of the body that it takes, for messages
  int first_vertex = 0, vertex_count = -1;  ///< of the body; below zero: all from the first on
  Eigen::Vector3d half_extents = Eigen::Vector3d::Constant(0.01);  ///< [m]
  double threshold = 0.01;                                         ///< [m]
};

/// How held vertices go to their targets.
enum class Closing {
  smooth,  ///< with no speed at both ends: fingers
  even,    ///< at one speed: supports of a quasistatic test
};

/// Vertices that something outside carries: a gripper, a support, a prescribed motion. It carries them in the
/// steps whose middle lies between `from` and `to`. A vertex that several holds take obeys the last of them
/// in each axis. One that springs hold is pulled by them along the axes that no hold carries rigidly.
struct Hold {
  std::string name = {};           ///< under which the force is told
  std::vector<int> vertices = {};  ///< empty with a reach, which takes them when the hold closes
  std::array<bool, 3> axes = {true, true, true};  ///< held axes of the base frame
  int frame = base_frame;                         ///< of the schedule
  data::Points targets = {};  ///< held places in the frame [m], a row each; empty: where the hold took them
  bool at_origin = false;     ///< the target of every vertex is the origin of the frame
  double from = -std::numeric_limits<double>::infinity();  ///< [s]
  double to = std::numeric_limits<double>::infinity();     ///< [s]
  double closing_time = 0.0;  ///< in which the vertices go to their targets, at least one step [s]
  Closing closing = Closing::smooth;
  std::optional<Reach> reach = {};
  /// Of springs between the vertices and their places [N/m], one a vertex, infinite: rigid. Empty: all rigid.
  Eigen::VectorXd stiffness = {};
};

/// Whether a hold carries the vertex `v` of those that it takes rigidly.
inline bool is_rigid(const Hold& hold, std::size_t v) {
  return hold.stiffness.size() == 0 || std::isinf(hold.stiffness[static_cast<Eigen::Index>(v)]);
}

/// Throws data::InputError where a hold with a stiffness does not have one, zero or more, for each of its
/// vertices, does not hold all axes, or has a reach.
void check_stiffness(const Hold& hold);

/// What a hold has taken; no vertices: it is open.
struct HeldVertices {
  std::vector<int> vertices;
  data::Points offsets;              ///< where they were in the frame when the hold took them [m], a row each
  double from = 0.0, arrival = 0.0;  ///< when they set out for the targets and arrive there [s]
};

/// Places of the held vertices in the frame at `time` [s], a row each.
data::Points held_places(const Hold& hold, const HeldVertices& held, double time);

}  // namespace flash::sim
