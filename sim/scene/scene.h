#pragma once
#include <array>
#include <map>
#include <string>
#include <vector>

#include "data/scene.h"
#include "sim/scene/environment.h"
#include "sim/scene/sheet.h"

namespace flash::sim {

/// One object of a scene, ready to step.
struct SceneBody {
  std::string name;
  Sheet sheet;  ///< vertex_area carries the mass: even where the asset spreads its mass evenly over the
                ///< vertices
  Environment environment;
  std::vector<std::string> obstacle_names;  ///< one an obstacle of the environment
  std::vector<std::string> grasp_names;     ///< one a grasp: end effectors and prescribed motions
  std::map<int, std::array<std::string, 3>> support_names;  ///< of fixed vertices, by axis; "" where free
  /// Grasps whose vertices are those near the end effector's box when they close.
  struct PendingGrasp {
    int grasp;         ///< index in the environment
    double from;       ///< [s]
    double threshold;  ///< [m]
    Eigen::Vector3d half_extents;
    bool zero_length;
  };
  std::vector<PendingGrasp> pending;
  /// Supports that move to their place.
  struct MovingSupport {
    int fixed;  ///< index in the environment
    Eigen::Vector3d start, end;
    double over;  ///< [s]
  };
  std::vector<MovingSupport> moving;
};

/// The objects of a scene; what was understood of units and what cannot be done goes to `notices`.
/// Throws data::InputError: solids, start positions that do not fit the mesh, vertices out of range.
std::vector<SceneBody> scene_bodies(const data::Scene& scene, std::vector<std::string>& notices);

/// Chooses the vertices of the grasps that close at the current time. Throws data::InputError where none is
/// within the threshold, with the distance of the nearest.
void close_pending_grasps(SceneBody& body);

/// Puts the moving supports where they are at `time`. Returns whether all have arrived.
bool move_supports(SceneBody& body, double time);

}  // namespace flash::sim
