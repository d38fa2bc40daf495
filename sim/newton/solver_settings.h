#pragma once
#include <atomic>
#include <functional>

namespace flash::sim {

struct State;

struct SolverSettings {
  double time_step = 0.01;      ///< h [s]
  int max_iterations = 60;      ///< Newton iterations a step
  double tolerance = 1e-3;      ///< on the relative residual |r| / |M g|
  int stale_factor_solves = 4;  ///< solves by a factor of an earlier iterate, beyond which it is renewed
  double exit_speed = 1.0;  ///< greatest speed at which vertices leave an obstacle that they start in [m/s]
  /// A step that cannot be solved is repeated in two halves, each so again, so often; where bodies that meet
  /// each other are fast at its start, until nothing goes farther in a part than the thickness of layers.
  int halvings = 8;
  const std::atomic<bool>* stop = nullptr;  ///< once set, a batch ends before its next step
  /// Sees the end of each part in which a step is taken, in their order.
  std::function<void(const State&)> part = {};
};

}  // namespace flash::sim
