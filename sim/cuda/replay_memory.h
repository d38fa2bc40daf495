#pragma once
#include <cuda_runtime.h>

#include <memory>
#include <span>
#include <vector>

#include "sim/cuda/batch_replay.h"
#include "sim/cuda/device_array.h"
#include "sim/cuda/device_plan.h"
#include "sim/cuda/devices.h"
#include "sim/cuda/layout/team_stages.h"
#include "sim/cuda/projective_replay.h"
#include "sim/cuda/replay_numbers.h"
#include "sim/cuda/team_memory.h"

namespace flash::sim::cuda {

/// What a replay has on the device, and how it goes on there.
struct ReplayMemory {
  ReplaySettings settings;
  int device = device_in_use();
  int count, step;
  FrontPlan front_plan;
  SheetLayout layout;
  DevicePlan plan;
  cudaStream_t stream = nullptr;
  int* stop = nullptr;  ///< of the host, read by the device

  std::vector<int> obstacle_counts;  ///< of each environment
  DeviceArray<ReplayMaterial> materials;
  DeviceArray<Point> positions, velocities, bristles, loads;
  DeviceArray<int> hold_starts, kept_index, order, steps, work, unfinished;
  DeviceArray<HeldPlace> holds;
  DeviceArray<int> spring_starts;
  DeviceArray<SpringPlace> springs;
  DeviceArray<double> stiffness;
  DeviceArray<PlacedObstacle> obstacles;
  DeviceArray<FramePose> poses;
  DeviceArray<ReplayStats> stats;
  DeviceArray<double> kept, hold_forces;
  DeviceArray<char> arena;
  DeviceArray<TeamMemory> team_memory;
  int teams = 0, team_blocks = 1;  ///< at first
  ReplayNumbers numbers{};
  std::vector<TeamStage> stages;
  std::vector<FrontTables> stage_fronts;
  std::unique_ptr<ProjectiveReplay> projection;  ///< of the projective method

  ReplayMemory(const SheetPlan& sheet, const std::vector<ReplayEnvironment>& environments,
               ReplaySettings replay_settings);
  ~ReplayMemory();

  std::size_t size() const;

  /// For what is queued; whoever comes next on this thread works with the device.
  void wait() const;

  /// Queues so many steps.
  void advance(int more);

  /// A part of an array with a point for each vertex.
  data::Points points(const DeviceArray<Point>& array, std::size_t part) const;

 private:
  void upload_state(const std::vector<ReplayEnvironment>& environments);

  /// Each environment has room for `most_obstacles_each`.
  void upload_bristles(const std::vector<ReplayEnvironment>& environments, int most_obstacles_each);

  /// What is held at once, at most.
  struct MostHeld {
    int vertices;
    bool springs;  ///< whether there are any
  };
  MostHeld upload_motions(const SheetPlan& sheet, const std::vector<ReplayEnvironment>& environments);

  void upload_stiffness(const std::vector<ReplayEnvironment>& environments);

  /// Returns how many obstacles an environment has at most.
  int upload_obstacles(const std::vector<ReplayEnvironment>& environments);
  void upload_kept_steps();

  /// Where an environment has but one turn with a team, none waits for a second one.
  void plan_stages();
  void lay_out_teams(const TeamSizes& sizes);
  void keep_start(const std::vector<ReplayEnvironment>& environments);
  void run_stages(int end) const;
};

std::vector<ReplayStep> steps_of(std::span<const ReplayStats> stats);

/// `points`: by order of elimination, which `order` has the vertices of.
void put_points(const Point* points, const std::vector<int>& order, Eigen::Ref<data::Points> to);

}  // namespace flash::sim::cuda
