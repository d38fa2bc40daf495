#pragma once
#include <memory>
#include <vector>

#include "sim/cuda/batch_replay.h"

namespace flash::sim::cuda {

/// All that a replay has of one environment but for its kept steps, each as BatchReplay has it.
struct ReplayResult {
  std::vector<ReplayStep> stats;
  std::vector<double> hold_forces;
  data::Points positions, velocities, bristles;
};

/// Reads the environments of a replay that has ended, which outlives it. Many threads read best with a reader
/// each: it has memory that the device writes to by itself, and waits once an environment.
class ReplayReader {
 public:
  explicit ReplayReader(const BatchReplay& replay);
  ~ReplayReader();

  /// `kept`: where positions go, kept steps x vertices x 3 [m].
  ReplayResult read(int environment, double* kept);

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace flash::sim::cuda
