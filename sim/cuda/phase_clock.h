#pragma once
#ifdef __CUDACC__
#include "sim/cuda/team.cuh"
#endif

namespace flash::sim::cuda {

/// Where the time of a step goes.
enum class ReplayPhase {
  evaluation,
  matrix,
  preconditioner,
  factorization,
  solves,
  products,
  directions,  ///< but for solves and products
  contact,
  rest
};
inline constexpr int replay_phases = 9;
inline constexpr const char* replay_phase_names[replay_phases] = {
    "energies and gradients", "matrix",  "preconditioner",
    "factorization",          "solves",  "products",
    "vectors of directions",  "contact", "rest"};

#ifdef __CUDACC__
/// Ticks of a team's first processor spent in each phase, and behind them when the present one began.
struct PhaseClock {
  long long* ticks = nullptr;  ///< null: not counted

  __device__ void start() const {
    if (team_rank() == 0) ticks[replay_phases] = clock64();
  }
  /// Counts the time since the last call to a phase. All threads have just been synchronized.
  __device__ void count(ReplayPhase phase) const {
    if (ticks == nullptr || team_rank() != 0) return;
    const long long now = clock64();
    ticks[static_cast<int>(phase)] += now - ticks[replay_phases];
    ticks[replay_phases] = now;
  }
};
#else
/// The serial team counts no time.
struct PhaseClock {
  long long* ticks = nullptr;

  void start() const {}
  void count(ReplayPhase) const {}
};
#endif

}  // namespace flash::sim::cuda
