#pragma once
#include "data/machine/memory_limit.h"
#include "sysid/replay/replay.h"

namespace flash::sysid {

/// Memory that a job will take at its peak [bytes].
struct MemoryEstimate {
  double program = 60e6;  ///< itself, with what scoring takes; measured
  double simulation = 0;  ///< solvers, one a thread, and the scored steps of all that are in work at once
  double steps = 0;       ///< the part of `simulation` that grows with the number of steps and keyframes
  double kept = 0;        ///< motions over the grid and about its finer mesh, where rollouts are kept
  double keyframes = 0;   ///< the part of `kept` that grows with the number of keyframes alone
  double total() const { return program + simulation + kept; }
};

/// What one position of one vertex takes [bytes]. Work.
inline constexpr double bytes_per_position = 3 * sizeof(double);

/// Number of vertices of the sheet or solid that is simulated.
double vertices_of(const Replay& replay);

/// What a solver of it takes [bytes].
double solver_bytes(const Replay& replay);

/// What a batch holds of one candidate [bytes]: positions at the scored steps, or at all, and how each step
/// went.
double motion_bytes(const Replay& replay, bool all_steps = false);

/// Memory for `candidates` simulated together (`run`), all results kept.
MemoryEstimate estimate_batch(const std::vector<Replay>& replays, std::size_t candidates,
                              bool all_steps = false);

/// Refuses what this machine cannot finish. Throws data::InputError, saying what would help, where the memory
/// goes beyond `limit` [bytes] (0: unknown), and where `candidates` on every replay take years.
void check_job(const std::vector<Replay>& replays, double candidates, const MemoryEstimate& memory,
               double limit = data::memory_limit());

}  // namespace flash::sysid
