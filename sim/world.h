#pragma once
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/device.h"
#include "sim/newton/restart_interval.h"
#include "sim/newton/solver.h"
#include "sim/oracle/projective.h"
#include "sim/scene/driven_schedule.h"
#include "sim/scene/end_effector.h"

namespace flash::sim {

struct WorldSettings {
  SolverSettings solver{};
  /// The projective method in place of Newton's, with the time step of its own; of `solver` only `stop`
  /// holds.
  std::optional<ProjectiveSettings> projective{};
  int restart_interval = sim::restart_interval;  ///< steps after which a solver forgets; 0: never
  /// A step that ends with a larger |r| / |M g| loses its environment.
  double lost_residual = std::numeric_limits<double>::infinity();
  long first_step = 0;  ///< steps that the environments have taken at their start
  int threads = 1;      ///< 0: one a processor
  Device device = Device::cpu;
  // Of a CUDA device:
  int cuda_device = 0;        ///< by number
  int steps_at_once = 1;      ///< so many of one call have memory from the start; more take more
  int positions_at_once = 0;  ///< likewise of steps whose positions are seen
};

/// Why an environment is not stepped any more.
enum class Lost {
  no,
  no_vertex_in_reach,  ///< a hold closed on nothing
  not_finite,          ///< a step ended in numbers that are none
  not_solved,          ///< with a residual above lost_residual
  refused,             ///< the solver cannot step such an environment
};

/// What a hold takes when it closes.
struct Grasp {
  std::vector<int> vertices{};   ///< those that it takes, in the order of the mesh
  std::optional<Reach> reach{};  ///< those within it; without both: as the hold itself says
  bool may_miss = false;         ///< a reach without a vertex leaves the hold open and loses no environment
};

/// One environment of Worlds on the processor: where it is, and what steps it.
struct World {
  Environment environment;
  State start_state;
  std::vector<Hold> start_holds;
  std::shared_ptr<const Schedule> plan;  ///< of its frames; those that are given poses leave it
  std::optional<DrivenSchedule> driven;  ///< once a frame is given one
  std::vector<bool> may_miss;            ///< by each hold that closes in the next step
  std::optional<Solver> newton;          ///< from the first step on
  std::optional<ProjectiveSolver> projective;
  StepReport report;  ///< of the last step
  long steps = 0;     ///< taken, first_step included
  Lost lost = Lost::no;
  std::string why_lost;  ///< in a line; empty while it is not lost
};

World make_world(Environment start, const WorldSettings& settings);

/// A copy that shares nothing that changes. With its solver, which goes on bitwise as the other.
World copy_of(const World& world);

/// Gives the world an end effector, the last of its holds and, where it collides, of its obstacles. It stands
/// in the last frame of `plan`, which otherwise is the schedule that the world has. Before the first step.
void add_end_effector(World& world, const EndEffector& effector, std::shared_ptr<const Schedule> plan);

/// The frame will be at `pose` at the end of the next step.
void set_pose(World& world, int frame, const Eigen::Isometry3d& pose, double time_step);

/// The hold closes in the next step, from where the environment stands then. One that carries vertices goes
/// on with them.
void grasp(World& world, int hold, const Grasp& grasp);

/// The hold opens in the next step.
void release(World& world, int hold);

/// Back to its start, but for its materials.
void reset(World& world, const WorldSettings& settings);

/// The parts of take_step. A step that a lost world does not take has an infinite residual.
void skip_step(World& world);

/// Lets the frames of a world go on to the next step, and opens the holds that may miss and do.
void begin_step(World& world);

/// Notes the report of a step from `start` [s], which may lose the world. `finite`: whether its positions
/// are.
void end_step(World& world, const WorldSettings& settings, StepReport report, double start, bool finite);

/// attempt(), where what it says of the environment loses the world. Returns whether it goes on.
bool goes_on(World& world, const std::function<void()>& attempt);

/// Takes one step, or none where the world is lost. What goes wrong in it loses the world.
void take_step(const std::shared_ptr<const SheetPlan>& plan, const WorldSettings& settings, World& world);

/// The contacts at the end of the last step; empty before the first.
std::vector<ContactForce> contacts_of(const World& world);

}  // namespace flash::sim
