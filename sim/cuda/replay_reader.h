#pragma once
#include <memory>
#include <mutex>
#include <vector>

#include "sim/cuda/replay_memory.h"

namespace flash::sim::cuda {

/// Where an environment is.
struct ReplayState {
  data::Points positions, velocities, bristles;  ///< as in State
};

/// Reads the environments of a replay that has ended, which outlives it. Many threads read best with a reader
/// each: it has memory that the device writes to by itself, and waits once an environment.
class ReplayReader {
 public:
  explicit ReplayReader(const ReplayMemory& replay) : replay_(replay) {}

  ReplayState read_state(int environment);

  /// `count` kept steps from the `first` on, each vertices x 3, to `to` [m].
  void read_kept(int environment, int first, int count, double* to);

 private:
  char* room(std::size_t bytes);

  const ReplayMemory& replay_;
  HostMemory pinned_;
  std::vector<char> pageable_;
};

/// Readers of a replay that no thread uses at the moment.
class IdleReaders {
 public:
  explicit IdleReaders(const ReplayMemory& replay) : replay_(replay) {}

  std::unique_ptr<ReplayReader> take();
  void give_back(std::unique_ptr<ReplayReader> reader);

 private:
  const ReplayMemory& replay_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<ReplayReader>> idle_;
};

}  // namespace flash::sim::cuda
