#pragma once
#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "data/mesh/mesh.h"

namespace flash::data {

class JsonObject;

/// Some vertices of an object. Exactly one of corner, vertices, position and box is set.
struct Selection {
  std::optional<std::array<int, 2>>
      corner;  ///< of the rest shape: (0, 0) is least x, least y; (1, 1) most x, most y
  std::vector<int> vertices;
  std::optional<Eigen::Vector3d> position;  ///< in the gripper frame at the start of its grasp [m]
  double within = 0.02;  ///< largest |dx|, |dy| from the corner, or distance from the position [m]
  std::optional<Eigen::AlignedBox3d> box = {};  ///< of the rest shape, object frame, open sides infinite [m]
};

/// Three numbers, `open` where the field is absent or a number is null.
Eigen::Vector3d read_bound(const JsonObject& object, const char* key, double open);

/// The field `select` of an object of the file. `vertices`: how many the mesh has. Throws InputError.
Selection read_selection(const JsonObject& owner, Eigen::Index vertices);

/// Vertices, in order of index; may be empty. `place`: that of a position, in the frame of `start` [m].
std::vector<int> vertices_in(const Selection& select, const Points& rest, const Points& start,
                             const Eigen::Vector3d& place);

}  // namespace flash::data
