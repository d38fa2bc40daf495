#pragma once
#include <functional>
#include <string>
#include <vector>

#include "data/scene.h"
#include "sim/environment.h"
#include "sim/sheet.h"

namespace flash::sim {

/// One object of a scene, ready to step.
struct SceneBody {
  std::string name;
  Sheet sheet;  ///< vertex_area carries the mass: even where the asset spreads its mass evenly over the
                ///< vertices
  Environment environment;
  std::vector<std::string> obstacle_names;  ///< one an obstacle of the environment
  std::vector<std::string> grasp_names;     ///< one a grasp: end effectors, or "prescribed"
  /// Grasps whose vertices are those near the end effector's box when they close.
  struct PendingGrasp {
    int grasp;         ///< index in the environment
    double from;       ///< [s]
    double threshold;  ///< [m]
    Eigen::Vector3d half_extents;
    bool zero_length;
  };
  std::vector<PendingGrasp> pending;
};

/// The objects of a scene; what was understood of units and what cannot be done goes to `notices`.
/// Throws data::InputError: solids, start positions that do not fit the mesh, vertices out of range.
std::vector<SceneBody> scene_bodies(const data::Scene& scene, std::vector<std::string>& notices);

/// Chooses the vertices of the grasps that close at the current time. Throws data::InputError where none is
/// within the threshold, with the distance of the nearest.
void close_pending_grasps(SceneBody& body);

/// How a run of a scene went.
struct SceneSummary {
  int steps = 0;               ///< done
  int unconverged_steps = 0;   ///< with an object whose residual stayed above the tolerance
  double residual_max = 0;     ///< worst |r| / |M g|
  double penetration_max = 0;  ///< [m]
  long iterations = 0;         ///< of all objects and steps
  int frames = 0;              ///< written
  double wall_seconds = 0;
  bool interrupted = false;
  std::vector<std::string> notices;
};

struct SceneRun {
  int steps = -1;                                     ///< to run; below zero: the scene's
  int threads = 1;                                    ///< objects step in parallel
  std::function<void(const std::string&)> notice;     ///< told each notice before the first step
  std::function<bool(int done, int steps)> progress;  ///< after each step; false stops the run
};

/// Runs a scene and writes, into output_dir: frames/%06d.ply (number: the step; all objects in one mesh),
/// log.csv (step, t, residual, iterations, penetration_max_m, complementarity, kinetic_J, elastic_J,
/// potential_J, converged) and forces.csv (t, body, fx, fy, fz: of the body on the objects [N]). What was
/// done is kept when the run stops early.
SceneSummary run_scene(const data::Scene& scene, const SceneRun& run, const std::string& output_dir);

}  // namespace flash::sim
