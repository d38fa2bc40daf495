#pragma once
#include <atomic>
#include <limits>
#include <memory>
#include <vector>

#include "sim/environment.h"
#include "sim/sheet.h"
#include "sim/sheet_plan.h"

namespace flash::sim {

struct SolverSettings {
  double time_step = 0.01;      ///< h [s]
  int max_iterations = 60;      ///< Newton iterations a step
  double tolerance = 1e-3;      ///< on the relative residual |r| / |M g|
  int stale_factor_solves = 5;  ///< solves by a factor of an earlier iterate, beyond which it is renewed
  const std::atomic<bool>* stop = nullptr;  ///< once set, simulate ends before its next step
};

/// How one step of one environment went.
struct StepReport {
  double residual = 0;  ///< |r| / |M g|; without gravity as if it were 9.81 m/s^2
  int iterations = 0;   ///< of Newton's method
  int solves = 0;       ///< with a factor: iterations of the linear solver
  int factorizations = 0;
  bool converged = false;
  double penetration_max = 0;                                    ///< deepest vertex below a surface [m]
  double complementarity = 0;                                    ///< max |min(gap, lambda / stiffness)| [m]
  double cone_violation = 0;                                     ///< max(|lambda_t| - mu lambda_n) [N]
  double kinetic = 0, membrane = 0, bending = 0, potential = 0;  ///< energies [J]
  std::vector<Eigen::Vector3d> grasp_forces;                     ///< gripper on sheet, one a grasp [N]
  std::vector<Eigen::Vector3d> obstacle_forces;                  ///< obstacle on sheet, one an obstacle [N]
  std::vector<Load> fixed_forces;                                ///< support on sheet, one a fixed vertex
};

/// Steps an environment by implicit Euler: semi-smooth Newton on the potential of the step, feasible at every
/// iterate. Holds what depends on the sheet and the last factorization, which later steps start from: one
/// Solver an environment.
class Solver {
 public:
  Solver(const Sheet& sheet, const SolverSettings& settings);
  Solver(std::shared_ptr<const SheetPlan> plan, const SolverSettings& settings);
  ~Solver();
  Solver(Solver&&) noexcept;

  /// Advances environment.state by one time step. An unconverged step is reported, never thrown.
  StepReport step(Environment& environment);

 private:
  struct Workspace;
  std::unique_ptr<Workspace> workspace_;
};

/// Positions of every step (index 0 is the start) and the reports of the steps.
struct Rollout {
  std::vector<data::Points> positions;
  std::vector<StepReport> reports;
};

/// The larger one; infinity where either is not a number, which std::max may lose.
inline double worst(double a, double b) {
  return a >= b ? a : b >= a ? b : std::numeric_limits<double>::infinity();
}

/// Runs `steps` steps of each environment, environments spread over `threads`. Result i equals environment i
/// alone, bitwise. Throws what a worker threw, and data::Stopped where settings.stop ended it.
std::vector<Rollout> simulate(const Sheet& sheet, std::vector<Environment> environments, int steps,
                              const SolverSettings& settings, int threads);

}  // namespace flash::sim
