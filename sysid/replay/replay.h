#pragma once
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "data/recording/recording.h"
#include "sim/batch.h"
#include "sysid/replay/motion.h"
#include "sysid/replay/observation.h"
#include "sysid/replay/sheet_distance.h"

namespace flash::sysid {

/// What every candidate of a replay has in common.
struct ReplaySettings {
  sim::SolverSettings solver;
  std::string mesh;       ///< mesh specification or file in place of the recording's; empty: the recording's
  double cell_scale = 1;  ///< of its cells and those at the grasps, at most 1 (replay_mesh.h)
  /// Edge length of the cells at each grasp [m]; absent: a fifth of those of the mesh or of the patch, where
  /// the mesh names no pattern of its own; 0: the mesh as it is.
  std::optional<double> grasp_cell;
  data::ElementOrder element_order = data::ElementOrder::linear;  ///< of a solid
  std::optional<double> pre_roll;  ///< simulated before the recording starts, gripper at its first pose;
                                   ///< absent: 0.4 where a grasp needs time to close, else 0 [s]
  double closing_time = 0.25;      ///< the fingers', within the pre-roll [s]
  std::optional<data::GraspShape> grasp_shape;  ///< in place of the recording's
  std::optional<double> grasp_within;           ///< in place of the recording's [m]
  bool clamp_slopes = false;  ///< clamp, from the beginning to the end: the patch does not bend either
  std::optional<sim::SelfContact> self_contact{};  ///< friction below zero: the candidate's; absent: the
                                                   ///< object passes through itself
  double score_from = -std::numeric_limits<double>::infinity();  ///< keyframes before carry no weight [s]
  double score_to = std::numeric_limits<double>::infinity();     ///< keyframes after carry no weight [s]
  int min_points = 20;  ///< keyframes of fewer points carry no weight
  int envs = 64;        ///< candidates simulated side by side, at most
  int threads = 1;
  sim::Device device = sim::Device::cpu;  ///< where candidates are simulated
  std::vector<int> cuda_devices{};        ///< which share them; empty: the first
};

/// Stiffness of pads that do not give way [N/m^3]. Theory: stands for infinity.
inline constexpr double rigid_pads = 1e12;

/// How the sheet lay and how it was grasped: what the recording leaves open and what changes the motion.
struct ReplayNuisance {
  double start_yaw = 0;     ///< turn of the sheet on the table about the gripper's first position [rad]
  double table_height = 0;  ///< of table and sheet, against the gripper's path [m]
  std::optional<double> grasp_size;       ///< clamp: of patches at corners; absent: the recording's [m]
  std::optional<double> grasp_stiffness;  ///< clamp: of the pads; absent, or from rigid_pads on: they do not
                                          ///< give way [N/m^3]
  std::optional<double> grasp_depth;      ///< pinch: size of the folded patch; absent: the recording's [m]
  std::optional<double> grasp_direction;  ///< pinch: angle of the ridge from the sheet's diagonal; absent:
                                          ///< the recording's [rad]
  std::optional<double> grasp_pitch;      ///< pinch: tilt of the ridge; absent: the recording's [rad]
};

struct ReplayCandidate {
  data::SheetMaterial material;  ///< of a sheet
  ReplayNuisance nuisance;
  std::optional<data::SolidMaterial> solid = {};  ///< of a solid
};

/// One candidate's simulated motion, its positions at the steps that were wanted, and how the solver fared.
struct ReplayResult {
  Motion motion;                 ///< of the surface
  bool converged = false;        ///< every step
  bool finite = false;           ///< all positions are numbers
  double residual_max = 0;       ///< |r| / |M g|
  double penetration_max = 0;    ///< [m]
  double unconverged_share = 0;  ///< of the steps
};

/// A recording made ready for simulation: its mesh, the start, the steps to take.
struct Replay {
  data::Recording recording;
  std::string
      object_mesh;  ///< mesh specification or file of the recording itself, whatever settings.mesh says
  std::shared_ptr<const sim::SheetPlan> plan;  ///< of the sheet or solid that is simulated
  data::TriangleMesh
      surface;  ///< what of it can be seen, at rest: a sheet itself, the outer faces of a solid
  std::vector<int> surface_vertices;              ///< those of a solid that the surface has; empty: a sheet
  std::shared_ptr<const sim::Schedule> schedule;  ///< of the grippers, a frame for each grasp
  std::shared_ptr<const SheetDistance> queries;   ///< of the surface at rest
  ReplaySettings settings;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< against gravity; the table normal without gravity
  Eigen::Vector3d pivot =
      Eigen::Vector3d::Zero();  ///< the first grasp's gripper at its start, or the sheet's centre
  double start = 0;             ///< time of the first state: the recording's start less the pre-roll [s]
  double beginning = 0;         ///< of the recording: its first grasp or keyframe [s]
  int steps = 0;
  std::vector<Observation> observations;
  std::vector<std::string> notices;

  const sim::Sheet& sheet() const { return plan->sheet; }
};

/// Time that is simulated before a recording starts: settings.pre_roll, or what its grasps need to close [s].
double pre_roll_of(const data::Recording& recording, const ReplaySettings& settings);

/// Steps of `step` that it takes to cover `duration` [s]. Throws data::InputError where they are more than
/// data::max_steps.
int steps_in(double duration, double step);

/// Throws data::InputError where mesh, grasps, clouds or the number of steps cannot be used. A `plan` that is
/// given is that of the same sheet, made for another replay of it.
Replay make_replay(const data::Recording& recording, const ReplaySettings& settings,
                   std::shared_ptr<const sim::SheetPlan> plan = nullptr);

/// A replay on another mesh of its object, that of `recording`. What was observed is taken over with its
/// weights.
Replay on_mesh(const Replay& replay, data::Recording recording, const ReplaySettings& settings,
               std::shared_ptr<const sim::SheetPlan> plan = nullptr);

/// The recording of a replay under other settings, on the same mesh unless settings.mesh or
/// settings.cell_scale changes. What was observed is taken over with its weights; no file is read but that of
/// another mesh.
Replay make_replay(const Replay& replay, const ReplaySettings& settings,
                   std::shared_ptr<const sim::SheetPlan> plan = nullptr);

/// A replay whose patches at corners are as large as `size` [m] (resize_grasps): the same triangles in
/// another place.
Replay with_grasp_size(const Replay& replay, double size);

/// The simulated world of one candidate, before its first step; grasp_size is left to `run`.
sim::Environment make_environment(const Replay& replay, const ReplayCandidate& candidate);

/// The steps that a score of the replay reads, ascending: the first, and those around each keyframe, as far
/// as its clock may be off.
std::vector<int> scored_steps(const Replay& replay);

/// All steps of a replay.
std::vector<int> every_step(const Replay& replay);

/// What a device cannot do yet of one of the candidates, in a line; empty where it can simulate all.
std::string why_not_on_device(const Replay& replay, const std::vector<ReplayCandidate>& candidates);

/// Simulates the candidates, replay.settings.envs of them at once, those of one grasp_size together. Only
/// positions at the steps `kept` are held; others are empty. The thread that simulated a candidate calls
/// `finished` with its number and result.
void run(const Replay& replay, const std::vector<ReplayCandidate>& candidates, const std::vector<int>& kept,
         const std::function<void(std::size_t, ReplayResult)>& finished);

/// Simulates the candidates, keeps positions at the scored steps, and returns all results together.
std::vector<ReplayResult> run(const Replay& replay, const std::vector<ReplayCandidate>& candidates);

}  // namespace flash::sysid
