#pragma once
#include <cuda_runtime.h>

#include <vector>

#include "sim/cuda/device_array.h"
#include "sim/cuda/flat_motions.h"
#include "sim/cuda/host_memory.h"
#include "sim/cuda/replay_numbers.h"

namespace flash::sim::cuda {

/// The next steps of environments, and what moves each of them meanwhile.
struct StepPlan {
  std::vector<int> begins, ends;  ///< of each environment; where they are alike it takes none
  std::vector<int> motions;       ///< of each, in `flat`
  FlatMotions flat;
  std::vector<int> kept_steps{};  ///< after which positions are kept, ascending

  int most_steps() const;  ///< of one environment
};

/// What a kernel reads of the steps at hand and what it says of them, on the device. One copy brings the
/// first there, another one brings the second back.
class StepTables {
 public:
  StepTables(int environments, int vertices, int holds, int obstacles);

  /// Takes memory for the results of so many steps at once; more take more.
  void reserve(int steps, int kept_steps);

  /// Queues a plan; its results are zero. What was queued before has ended.
  void open(const StepPlan& plan, cudaStream_t stream);

  /// Queues steps of an open plan again, from `begin` up to `end` of all environments.
  void queue(int begin, int end, cudaStream_t stream);

  /// Notes the work of a step that an environment has taken. Those that took most in their last steps are
  /// taken up first in the next ones, so that none of them is left to the end.
  void note_work(int environment, int work);

  /// Sets what kernels have of an open plan.
  void put(ReplayNumbers& numbers) const;

  /// Queues the copy of all results but for kept positions.
  void fetch(cudaStream_t stream);

  // After a fetch has ended, the results of an environment: a row a step, from its `begins` on.
  const ReplayStats* stats(int environment) const;
  const double* hold_forces(int environment) const;      ///< holds x 3 a row [N]
  const double* obstacle_forces(int environment) const;  ///< obstacles x 3 a row [N]

  /// Places of the `index`-th kept step, vertices x 3 in the order of the mesh, on the device [m].
  const double* kept(int environment, int index) const;

 private:
  struct Places {
    int *begins, *ends, *steps, *work, *unfinished, *motions, *hold_starts, *spring_starts, *kept_index;
    float* expected;
    HeldPlace* holds;
    SpringPlace* springs;
    FramePose* poses;
    std::size_t queue_bytes, bytes;  ///< `unfinished` and what is before it; all
  };
  struct Results {
    ReplayStats* stats;
    double *hold_forces, *obstacle_forces;
    std::size_t bytes;
  };
  Places lay_out(char* begin) const;
  Results lay_out_results(char* begin) const;
  std::size_t row(int environment) const;
  void copy_to_device(std::size_t bytes, cudaStream_t stream);

  std::size_t environments_, vertices_, holds_, obstacles_;
  std::vector<float> expected_;  ///< work of a step of each environment
  // Of the open plan.
  std::size_t steps_ = 0, motions_ = 0, held_ = 0, springs_ = 0, kept_ = 0, kept_index_ = 0;
  int frames_ = 0, kept_begin_ = 0;

  HostMemory tables_, results_;
  DeviceArray<char> device_tables_, device_results_;
  DeviceArray<double> kept_positions_;
};

}  // namespace flash::sim::cuda
