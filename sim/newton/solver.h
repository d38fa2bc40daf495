#pragma once
#include <memory>
#include <vector>

#include "sim/newton/solver_settings.h"
#include "sim/newton/step_report.h"
#include "sim/plan/sheet_plan.h"
#include "sim/scene/environment.h"
#include "sim/scene/sheet.h"
#include "sim/step/contact_force.h"

namespace flash::sim {

struct NewtonWorkspace;

/// Memory that a Solver takes with the plan of its sheet: matrix, factor, contact and their work space.
/// Measured on sheets of 250 to 4,000 vertices.
inline constexpr double solver_bytes_per_vertex = 14e3;

/// Steps an environment by implicit Euler: semi-smooth Newton on the potential of the step, feasible at every
/// iterate. A step that does not converge, or whose potential or energy would end above where it began, is
/// repeated in halves. Each environment has its own Solver, which holds the last factorization for later
/// steps to start from. So last digits depend on where it began, unless it forgets.
class Solver {
 public:
  Solver(const Sheet& sheet, const SolverSettings& settings);
  Solver(std::shared_ptr<const SheetPlan> plan, const SolverSettings& settings);
  ~Solver();
  /// A copy goes on as the one it is of, bitwise. It takes as much memory.
  Solver(const Solver&);
  Solver(Solver&&) noexcept;
  Solver& operator=(Solver) noexcept;

  /// Advances environment.state by one time step. An unconverged step is reported, never thrown. Throws
  /// data::InputError for a material that the sheet cannot have, such as a plate with a rest shape not flat,
  /// and where the surface that meets itself passes through itself at the first step.
  StepReport step(Environment& environment);

  /// The contacts at the end of the last step, or of its last part, of the environment that took it. Empty
  /// before the first step.
  std::vector<ContactForce> contacts(const Environment& environment) const;

  /// The next step starts as that of a new Solver does.
  void forget();

 private:
  std::unique_ptr<NewtonWorkspace> workspace_;
};

/// Throws data::InputError where a surface cannot meet itself: layers as thick as the mean edge of a body, or
/// positions in which it passes through itself.
void check_self_contact(const Sheet& sheet, double thickness, const data::Points& positions);

}  // namespace flash::sim
