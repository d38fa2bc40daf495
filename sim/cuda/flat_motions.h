#pragma once
#include <compare>
#include <map>
#include <vector>

#include "sim/cuda/batch_replay.h"
#include "sim/cuda/replay_numbers.h"

namespace flash::sim::cuda {

/// What moves an environment by itself over some steps. What is null moves nothing.
struct Motion {
  const HoldMotion* holds = nullptr;       ///< by step; after the last none
  const SpringMotions* springs = nullptr;  ///< likewise
  const Schedule* schedule = nullptr;      ///< of the frames that obstacles name
  double time = 0;                         ///< at the start of the first step [s]

  auto operator<=>(const Motion&) const = default;
};

/// What holds and obstacles of environments do, as kernels read it: the motions one after the other, each
/// once.
struct FlatMotions {
  std::vector<int> starts;  ///< of each step of a motion in `holds`, and its end
  std::vector<HeldPlace> holds;
  std::vector<int> spring_starts;    ///< likewise, in `springs`
  std::vector<SpringPlace> springs;  ///< those of a vertex in a step one behind the other
  std::vector<FramePose> poses;      ///< of the frames, at the start of a motion and after each step
  int frames = 0;                    ///< of the schedules, at most
  int most = 0;                      ///< held in one step

  /// The number of a motion, which is added where it is new. `position`: of each vertex in the order of
  /// elimination. Throws std::invalid_argument where a vertex is not there or is held twice.
  int add(const Motion& motion, double time_step, int steps, const std::vector<int>& position);

  int count() const { return static_cast<int>(motions_.size()); }

 private:
  void add_poses(const Motion& motion, double time_step, int steps);

  std::map<Motion, int> motions_;
  std::vector<long> held_in_;  ///< the last step that holds each vertex, of all steps added
  long steps_added_ = 0;
};

}  // namespace flash::sim::cuda
