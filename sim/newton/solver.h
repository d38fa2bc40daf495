#pragma once
#include <atomic>
#include <limits>
#include <memory>
#include <vector>

#include "sim/plan/sheet_plan.h"
#include "sim/scene/environment.h"
#include "sim/scene/sheet.h"
#include "sim/step/contact_geometry.h"

namespace flash::sim {

struct SolverSettings {
  double time_step = 0.01;      ///< h [s]
  int max_iterations = 60;      ///< Newton iterations a step
  double tolerance = 1e-3;      ///< on the relative residual |r| / |M g|
  int stale_factor_solves = 5;  ///< solves by a factor of an earlier iterate, beyond which it is renewed
  double exit_speed = 1.0;      ///< at which vertices that start inside an obstacle come out, at most [m/s]
  int halvings = 8;  ///< a step that cannot be solved is repeated in two halves, each so again, so often
  const std::atomic<bool>* stop = nullptr;  ///< once set, a batch ends before its next step
};

/// How one step of one environment went.
struct StepReport {
  double residual = 0;  ///< |r| / |M g|; without gravity as if it were 9.81 m/s^2
  int iterations = 0;   ///< of Newton's method
  int solves = 0;       ///< with a factor: iterations of the linear solver
  int factorizations = 0;
  int substeps = 1;  ///< more where the step could not be solved as one
  /// Force balance to the tolerance, as a whole and to 30 times of it at every vertex; gaps and
  /// complementarity; no energy from nothing. Contact forces lie in the friction cone at every iterate.
  bool converged = false;
  double penetration_max = 0;     ///< deepest vertex below a surface, held ones too [m]
  Penetration held_penetration;   ///< the deepest that a support or a gripper holds below a surface
  Penetration start_penetration;  ///< the deepest other that started the step inside an obstacle
  double complementarity = 0;  ///< largest gap of a vertex that a surface pushes, or depth of any other [m]
  double kinetic = 0, membrane = 0, bending = 0, potential = 0;  ///< energies [J]
  double work = 0;  ///< that supports, grippers and obstacles did on the sheet, those that do any [J]
  // Forces of a step in parts are their means over time.
  std::vector<Eigen::Vector3d> grasp_forces;     ///< gripper on sheet, one a grasp [N]
  std::vector<Eigen::Vector3d> obstacle_forces;  ///< obstacle on sheet, one an obstacle [N]
  std::vector<Load> fixed_forces;                ///< support on sheet, one a fixed vertex
};

/// Memory that a Solver takes with the plan of its sheet: matrix, factor, contact and their work space.
/// Measured on sheets of 250 to 4,000 vertices.
inline constexpr double solver_bytes_per_vertex = 14e3;

/// Steps an environment by implicit Euler: semi-smooth Newton on the potential of the step, feasible at every
/// iterate. A step that does not converge, or whose potential or energy would end above where it began, is
/// repeated in halves. Holds what depends on the sheet and the last factorization, which later steps start
/// from: one Solver an environment, and last digits that depend on where it began, unless it forgets.
class Solver {
 public:
  Solver(const Sheet& sheet, const SolverSettings& settings);
  Solver(std::shared_ptr<const SheetPlan> plan, const SolverSettings& settings);
  ~Solver();
  Solver(Solver&&) noexcept;

  /// Advances environment.state by one time step. An unconverged step is reported, never thrown. Throws
  /// data::InputError for a material that the sheet cannot have, such as a plate with a rest shape not flat.
  StepReport step(Environment& environment);

  /// The next step starts as that of a new Solver does.
  void forget();

  struct Workspace;  ///< of its own

 private:
  std::unique_ptr<Workspace> workspace_;
};

/// The larger one; infinity where either is not a number, which std::max may lose.
inline double worst(double a, double b) {
  return a >= b ? a : b >= a ? b : std::numeric_limits<double>::infinity();
}

}  // namespace flash::sim
