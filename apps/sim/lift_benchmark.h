#pragma once
#include <atomic>
#include <string>
#include <vector>

#include "data/machine/memory_limit.h"
#include "sim/batch.h"
#include "sim/cpu/instruction_level.h"

namespace flash::sim {

/// Corner lift of a square towel of 0.4 m by many materials at once: E t and D spread over their ranges,
/// evenly in the logarithm.
struct LiftBenchmark {
  int vertices = 1000;  ///< about; the mesh has the next square number
  int environments = 64;
  bool alone = false;  ///< one environment after the other, each by itself
  int steps = 250;
  int threads = 1;
  InstructionLevel level = highest_instruction_level();  ///< of the kernels
  Device device = Device::cpu;
  std::vector<int> cuda_devices{};  ///< as in BatchSettings
  /// The published method on its fixed budget, in place of Newton's: five local-global iterations, up to ten
  /// of contact with the inertia metric, isometric bending. `tolerance` ends a step earlier. On the CPU
  /// alone.
  bool projective = false;
  double time_step = 0.01;                                           ///< [s]
  double tolerance = 1e-3;                                           ///< on |r| / |M g|
  double membrane_stiffness_min = 10, membrane_stiffness_max = 300;  ///< E t [N/m]
  double bending_rigidity_min = 1e-5, bending_rigidity_max = 1e-4;   ///< D [N m]
  double poissons_ratio = 0.3;
  double areal_density = 0.2;  ///< [kg/m^2]
  double friction = 0.3;
};

/// One part of a step: how often it ran, and how long one run takes by itself on the towel in mid-air.
struct BenchmarkPhase {
  std::string name;
  double calls_per_step;
  double milliseconds_per_call;
};

struct LiftBenchmarkResult {
  int vertices = 0;
  double start_seconds = 0;      ///< of a device, until it has taken the first step of one material
  double wall_seconds = 0;       ///< after that
  double step_milliseconds = 0;  ///< wall time a step and environment, times the threads at work; on a device
                                 ///< a step of all environments at once, which is one where they are alone
  double converged_share = 0;    ///< of environment-steps
  double residual_max = 0;
  double iterations = 0;                  ///< Newton's, a step
  double iterations_max = 0;              ///< a step of the material that takes most
  double slowest_membrane_stiffness = 0;  ///< E t of that material [N/m]
  double slowest_bending_rigidity = 0;    ///< D of it [N m]
  double solves = 0, factorizations = 0;  ///< a step
  std::vector<BenchmarkPhase>
      phases;  ///< of the CPU: their sum leaves contact, line search and the rest of step_milliseconds
  std::vector<PhaseShare> phase_shares;     ///< of a device
  double least_bytes = 0, least_flops = 0;  ///< of a step of one environment on a device, without contact
};

/// Environments that are simulated together.
int environments_together(const LiftBenchmark& benchmark);

/// What it takes on the CPU at least, however fast that is [s]; 0: of a device nothing is known.
double least_seconds(const LiftBenchmark& benchmark);

/// Throws data::InputError where a range ends below its start, where the solvers at work and what is kept of
/// the environments that run at once need more than `memory_limit` [bytes] (0: unknown), or where a device is
/// to take more vertices than any can; and where the CPU takes longer than a day.
void check(const LiftBenchmark& benchmark, double memory_limit = data::memory_limit());

/// Throws as check() does; data::Stopped within a step after `stop` is set.
LiftBenchmarkResult run_lift_benchmark(const LiftBenchmark& benchmark, const std::atomic<bool>& stop);

}  // namespace flash::sim
