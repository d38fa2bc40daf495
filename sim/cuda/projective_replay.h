#pragma once
#include <cuda_runtime.h>

#include <vector>

#include "sim/cuda/batch_replay.h"
#include "sim/cuda/device_array.h"
#include "sim/cuda/layout/inverse_tree.h"
#include "sim/cuda/layout/sheet_layout.h"
#include "sim/cuda/projective_numbers.h"

namespace flash::sim::cuda {

/// What the projective method needs memory for.
struct ProjectiveSizes {
  const SheetPlan& plan;
  const SheetLayout& layout;
  const std::vector<int>& position;  ///< place of each vertex
  bool damped;
  int most_obstacles;
};

/// The part of a replay that the projective method has for itself: a constant factor for each material, and
/// the memory of its teams.
class ProjectiveReplay {
 public:
  /// `numbers`: what both methods have; what they point to outlives this. Throws as BatchReplay does, and
  /// data::InputError where a material has no factor.
  ProjectiveReplay(const ProjectiveSizes& sizes, const std::vector<ReplayEnvironment>& environments,
                   const ReplaySettings& settings, const ReplayNumbers& numbers);

  int team_blocks() const { return blocks_; }
  int teams() const { return static_cast<int>(team_memory_.size()); }
  /// Queues the steps of the environments that wait.
  void run(cudaStream_t stream) const;
  /// Ticks that teams spent in each ProjectivePhase.
  std::vector<double> phase_ticks() const;

 private:
  void upload_tree(const InverseTree& tree);
  void upload_triangles(const SheetLayout& layout);
  void upload_factors(const ProjectiveSizes& sizes, const InverseTree& tree,
                      const std::vector<ReplayEnvironment>& environments, const ReplaySettings& settings);
  void lay_out_teams(const ProjectiveSizes& sizes, int environments);

  int blocks_;  ///< of a team

  InversePrecision precision_;
  ProjectiveNumbers numbers_{};
  DeviceArray<char> solve_tables_;
  DeviceArray<int> corner_shares_, factor_of_;
  DeviceArray<int4> triangle_corners_;
  DeviceArray<Four<float>> triangle_gradients_;
  DeviceArray<std::uint16_t> tiles_;
  DeviceArray<SolveVertex> vertices_;
  DeviceArray<char> arena_;
  DeviceArray<ProjectiveMemory> team_memory_;
};

}  // namespace flash::sim::cuda
