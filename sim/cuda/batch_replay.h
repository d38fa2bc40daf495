#pragma once
#include <Eigen/Core>
#include <array>
#include <atomic>
#include <limits>
#include <memory>
#include <vector>

#include "data/asset/material.h"
#include "data/mesh/mesh.h"
#include "sim/cuda/environment_numbers.h"
#include "sim/cuda/layout/front_plan.h"
#include "sim/newton/restart_interval.h"
#include "sim/plan/sheet_plan.h"
#include "sim/scene/environment.h"

namespace flash::sim::cuda {

/// A vertex held in some axes at the end of a step. A share s of the step on, which halved steps ask for, its
/// place is
///
///     from + s (target - from) + s (1 - s) bow,
///
/// from where it is when the step begins. The bow makes the middle that of the frame. Elsewhere a frame that
/// turns is missed by less than a hundredth of the radius times the cube of the turn [rad].
struct HeldVertex {
  int vertex;
  std::array<bool, 3> axes = {true, true, true};
  Eigen::Vector3d target;                         ///< places of the held axes [m]
  std::array<int, 3> holds = {0, 0, 0};           ///< number of the hold that each axis obeys
  Eigen::Vector3d bow = Eigen::Vector3d::Zero();  ///< [m]

  bool operator==(const HeldVertex&) const = default;
};

/// What is held in each step, no vertex twice in one.
using HoldMotion = std::vector<std::vector<HeldVertex>>;

/// A spring between a vertex and its place in a soft hold over a step (sim/step/springs).
struct SpringMotion {
  int vertex, hold;
  int entry;                                      ///< of its stiffness among those of the environment
  std::array<bool, 3> axes;                       ///< in which it acts
  Eigen::Vector3d from, to;                       ///< its place at the start and at the end of the step [m]
  Eigen::Vector3d bow = Eigen::Vector3d::Zero();  ///< between them, as that of a HeldVertex [m]

  bool operator==(const SpringMotion&) const = default;
};

/// The springs of each step.
using SpringMotions = std::vector<std::vector<SpringMotion>>;

/// One environment: a sheet, its start, what holds it and what it meets. Environments may share motions.
struct ReplayEnvironment {
  data::SheetMaterial material;
  Eigen::Vector3d gravity{0, 0, -9.81};  ///< [m/s^2]
  std::vector<Load> loads;
  std::shared_ptr<const HoldMotion> holds;            ///< by step, from first_step on
  int hold_count = 1;                                 ///< all environments have as many
  std::shared_ptr<const SpringMotions> springs = {};  ///< as `holds`; null: none
  std::vector<double> stiffness = {};                 ///< of springs, by entry [N/m]
  std::vector<Obstacle> obstacles;
  std::shared_ptr<const Schedule> schedule;  ///< of the frames that obstacles name; none: all at rest
  double time = 0;                           ///< at which it stands [s]
  data::Points positions, velocities;        ///< [m], [m/s]
  data::Points bristles = {};                ///< as in State
};

struct ReplaySettings {
  // As in SolverSettings.
  double time_step = 0.01;      ///< h [s]
  int max_iterations = 60;      ///< Newton iterations a step
  double tolerance = 1e-3;      ///< on the relative residual |r| / |M g|
  int stale_factor_solves = 4;  ///< solves by a factor of an earlier iterate, beyond which it is renewed
  double exit_speed = 1.0;  ///< greatest speed at which vertices leave an obstacle that they start in [m/s]
  int halvings = 8;         ///< a step that cannot be solved is repeated in two halves, so often

  int first_step = 0;             ///< at which the environments stand
  int steps = 0;                  ///< the last one
  std::vector<int> kept_steps{};  ///< whose positions are kept, ascending; step 0 is the start
  /// Steps after which a solver forgets what it has besides the state; 0: never.
  int restart_interval = sim::restart_interval;
  /// A step that ends with a larger residual, or with one that is no number, is the last of its environment.
  double lost_residual = std::numeric_limits<double>::infinity();
  int team_blocks = 0;  ///< processors that work on an environment, 1, 2, 4 or 8; 0: team_stages has it
  FrontSettings fronts{};
};

/// How one step of one environment went, as in StepReport.
struct ReplayStep {
  double residual = 0;         ///< |r| / |M g|
  double penetration_max = 0;  ///< deepest vertex below a surface [m]
  int iterations = 0, solves = 0, factorizations = 0, substeps = 0;
  bool converged = false;
};

struct ReplayMemory;

/// Replays of many environments of one sheet on the device, each step to the tolerance that the CPU's Solver
/// has. A team, one processor or several, takes an environment through up to `turn_steps` steps and then
/// another one that waits. So none waits for the others, and what an environment gets depends on its own
/// numbers alone, bitwise. Linear problems are in single precision, energies, residuals, contact and
/// positions in double. Held vertices and places of springs move on a straight line within a step that has to
/// be halved.
class BatchReplay {
 public:
  /// Throws std::invalid_argument where environments do not fit the plan, miss holds or springs for a step,
  /// or have more than most_obstacles; std::runtime_error with the device's message.
  BatchReplay(std::shared_ptr<const SheetPlan> plan, const std::vector<ReplayEnvironment>& environments,
              ReplaySettings settings);
  ~BatchReplay();
  BatchReplay(BatchReplay&&) noexcept;

  int size() const;
  int step() const;         ///< steps that are queued or taken, first_step included
  int teams() const;        ///< environments that the device works on at the same time, at first
  int team_blocks() const;  ///< processors that work on an environment, at first

  /// Queues the next steps of all environments and returns; what reads results waits for them.
  void advance(int steps);
  /// Waits for what is queued. Once `stop` is set the device ends after the steps that its teams are at, and
  /// the results are of no use.
  void synchronize(const std::atomic<bool>* stop = nullptr);

  data::Points positions(int environment) const;   ///< [m]
  data::Points velocities(int environment) const;  ///< [m/s]
  data::Points bristles(int environment) const;    ///< as in State
  data::Points kept_positions(int environment, int index) const;
  /// Forces of the holds on the sheet, mean over each step: steps from first_step on x holds x 3 [N].
  std::vector<double> hold_forces(int environment) const;
  std::vector<ReplayStep> stats(int environment) const;  ///< a step each, from first_step on
  /// Ticks that the teams' first processors spent in each ReplayPhase.
  std::vector<double> phase_ticks() const;

  const ReplayMemory& memory() const;

 private:
  struct Replay;
  std::unique_ptr<Replay> replay_;
};

}  // namespace flash::sim::cuda
