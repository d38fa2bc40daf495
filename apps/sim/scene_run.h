#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "data/scene/scene.h"
#include "sim/device.h"
#include "sim/scene/variation.h"

namespace flash::sim {

/// How a run of a scene went: but for the counts of environments, environment 0 of it.
struct SceneSummary {
  int steps = 0;                     ///< done
  int unconverged_steps = 0;         ///< with an object whose residual stayed above the tolerance
  double residual_max = 0;           ///< worst |r| / |M g|
  double complementarity_max = 0;    ///< [m]
  int halved_steps = 0;              ///< that could not be solved as one, and were in parts
  double penetration_max = 0;        ///< [m]
  double held_penetration_max = 0;   ///< of vertices that supports or end effectors hold [m]
  double start_penetration_max = 0;  ///< of vertices that start a step inside an obstacle [m]
  bool self_contact = false;         ///< whether objects meet themselves and each other
  double layer_distance_min =
      0;                       ///< with self-contact: the nearest that layers came at the end of a step [m]
  int layer_touches_max = 0;   ///< pairs of features that pressed each other, at most
  int collapsed_elements = 0;  ///< tetrahedra of one object with less than a thousandth of their rest volume
                               ///< at the end of a step, at most
  long iterations = 0;         ///< of all objects and steps
  int frames = 0;              ///< written
  double wall_seconds = 0;
  bool interrupted = false;
  double last_motion = 0;       ///< quasistatic: of the vertex that moved farthest in the last step [m]
  std::optional<bool> at_rest;  ///< whether that is below the scene's bound after a step that is solved;
                                ///< none: not quasistatic
  int environments = 1;
  int unusable_environments = 0;  ///< of several: lost, or with too many steps that are not solved
  std::string first_unusable;     ///< of them, and why it is lost
  std::vector<std::string> notices;
  std::vector<std::string> warnings;  ///< of solids that lock or collapse, of holds, and of vertices held
                                      ///< inside an obstacle or that start there
};

struct SceneRun {
  int steps = -1;                       ///< to run; below zero: the scene's
  int threads = 1;                      ///< objects step in parallel, or the environments of each
  int environments = 1;                 ///< of the scene, side by side
  std::vector<Variation> variations{};  ///< by which those after the first differ
  bool contacts = false;                ///< whether to write contacts and resultants at each frame
  DeviceChoice device{};                ///< where all of it is stepped: the CPU or one CUDA device
  std::function<void(const std::string&)> notice = {};  ///< told each notice before the first step
  std::function<void(const std::string&)> phase = {};   ///< told what begins that may take minutes
  /// Before the first step and after each; false stops the run.
  std::function<bool(int done, int steps)> progress = {};
};

/// Runs a scene and writes, into output_dir: frames/%06d.ply (number: the step; all objects in one mesh),
/// log.csv (step, t, residual, iterations, penetration_max_m, complementarity, kinetic_J, elastic_J,
/// potential_J, converged, membrane_J, bending_J, substeps; with self-contact then layer_distance_m,
/// layer_touches, layer_pairs, layers_J) and forces.csv (t, body, fx, fy, fz: of the body
/// on the objects [N]). With run.contacts also contacts/%06d.csv beside each frame but that of the start, and
/// resultants.csv, as contact_table and resultant_rows say. All of these are of environment 0; of several
/// there is environments.csv, as environment_table says. The last step of a quasistatic run is always a
/// frame. What was done is kept when the run stops early; nothing is written before the first step is done,
/// and then frames and tables of an earlier run go first. Throws data::InputError, too, where the scene needs
/// more memory than there is.
SceneSummary run_scene(const data::Scene& scene, const SceneRun& run, const std::string& output_dir);

}  // namespace flash::sim
