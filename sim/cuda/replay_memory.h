#pragma once
#include <cuda_fp16.h>
#include <cuda_runtime.h>

#include <map>
#include <memory>
#include <span>
#include <vector>

#include "sim/cuda/batch_replay.h"
#include "sim/cuda/device_array.h"
#include "sim/cuda/device_plan.h"
#include "sim/cuda/devices.h"
#include "sim/cuda/layout/team_stages.h"
#include "sim/cuda/replay_numbers.h"
#include "sim/cuda/step_tables.h"
#include "sim/cuda/team_memory.h"

namespace flash::sim::cuda {

/// Environments on the device, each with what its solver keeps of it from step to step, and the teams that
/// step them. What a step gives depends on these alone, bitwise, whatever steps are queued together.
struct ReplayMemory {
  ReplaySettings settings;
  int device = device_in_use();
  int count, most_obstacles_each;
  FrontPlan front_plan;
  SheetLayout layout;
  DevicePlan plan;
  cudaStream_t stream = nullptr;
  int* stop = nullptr;  ///< of the host, read by the device

  std::vector<int> obstacle_counts;  ///< of each environment
  DeviceArray<ReplayMaterial> materials;
  DeviceArray<Point> positions, velocities, bristles, loads;
  DeviceArray<int> order;
  DeviceArray<double> stiffness;
  DeviceArray<PlacedObstacle> obstacles;
  DeviceArray<SheetTables> sheets;
  DeviceArray<SolverState> solvers;
  DeviceArray<__half> factors;
  DeviceArray<char> arena;
  DeviceArray<TeamMemory> team_memory;
  int teams = 0, team_blocks = 1;  ///< at first
  ReplayNumbers numbers{};
  StepTables tables;  ///< of the steps at hand

  /// Environments as they stand, without their motions.
  ReplayMemory(std::shared_ptr<const SheetPlan> sheet, const std::vector<ReplayEnvironment>& environments,
               ReplaySettings replay_settings);
  ~ReplayMemory();
  ReplayMemory(const ReplayMemory&) = delete;

  std::size_t size() const;

  /// For what is queued; whoever comes next on this thread works with the device. Once `stop` is set the
  /// device ends after the steps that its teams are at, and the results are of no use.
  void wait(const std::atomic<bool>* stop = nullptr) const;

  // Once what was queued has ended:

  void write_state(int environment, const data::Points& positions, const data::Points& velocities,
                   const data::Points& bristles);
  void write_velocities(int environment, const data::Points& velocities);
  /// Material, gravity, loads, stiffness and obstacles. The solver starts anew: what it has is of others.
  void write_environment(const ReplayEnvironment& environment, int number);
  /// The next step of an environment starts as that of a new one.
  void forget_solver(int environment);
  /// All that the device has of an environment but for its material, as bytes of memory.
  std::vector<char> save(int environment) const;
  /// Throws std::invalid_argument for what was saved of another mesh or with other obstacles.
  void load(int environment, const std::vector<char>& saved);

  /// Queues the tables of a plan.
  void open(const StepPlan& steps);
  /// Queues the steps of a plan.
  void run(const StepPlan& steps);
  /// Queues steps of an open plan, from `begin` up to `end` of all environments.
  void go_on(int begin, int end);

  /// The positions at the start are those of kept step 0, where that is the first one.
  void keep_start(const std::vector<ReplayEnvironment>& environments);

  /// A part of an array with a point for each vertex.
  data::Points points(const DeviceArray<Point>& array, std::size_t part) const;

  /// Ticks that the teams' first processors spent in each phase.
  std::vector<double> phase_ticks() const;

 private:
  /// act(where it is on the device, bytes) for each part of an environment's state.
  template <typename Act>
  void for_state(int environment, const Act& act) const;

  std::shared_ptr<const SheetPlan> sheet_;
  std::map<int, int> resident_;        ///< teams that the device runs at once, by their blocks
  std::map<int, FrontTables> fronts_;  ///< by the blocks of a team
  std::vector<std::shared_ptr<const DeviceBending>> bendings_;  ///< of each environment; null: the plan's
  std::map<const BendingOperator*, std::weak_ptr<const DeviceBending>> shared_bendings_;
  const BendingOperator* plan_bending_;

  void upload(const std::vector<ReplayEnvironment>& environments);
  /// Each environment has room for most_obstacles_each.
  void put_bristles(const data::Points& own, Point* to) const;
  void write_loads(const ReplayEnvironment& environment, std::size_t number);
  void write_stiffness(const std::vector<double>& own, std::size_t number);
  void set_numbers(const ReplayEnvironment& first);
  SheetTables with_bending_of(const data::SheetMaterial& material, int environment);

  /// For so many environments. Where one has but one turn with a team, none waits for a second one.
  std::vector<TeamStage> stages_for(int environments, int steps) const;
  void plan_teams();
  void lay_out_teams();
  void launch_steps(int environments, int steps);
};

std::vector<ReplayStep> steps_of(std::span<const ReplayStats> stats);

}  // namespace flash::sim::cuda
