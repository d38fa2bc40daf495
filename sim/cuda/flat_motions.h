#pragma once
#include <map>
#include <tuple>
#include <vector>

#include "sim/cuda/batch_replay.h"
#include "sim/cuda/replay_numbers.h"

namespace flash::sim::cuda {

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

  /// The number of the environment's motion, which is added where it is new. `position`: of each vertex in
  /// the order of elimination. Throws std::invalid_argument where a vertex is not there or is held twice.
  int add(const ReplayEnvironment& environment, double time_step, int steps,
          const std::vector<int>& position);

 private:
  /// What environments with the same motion share.
  using Key = std::tuple<const HoldMotion*, const SpringMotions*, const Schedule*, double>;
  std::map<Key, int> motions_;
};

}  // namespace flash::sim::cuda
