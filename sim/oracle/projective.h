#pragma once
#include <memory>
#include <string>
#include <vector>

#include "sim/newton/solver.h"
#include "sim/oracle/constraint_newton.h"

namespace flash::sim {

/// What stands for the compliance of the contacts in the Newton system of their multipliers.
enum class ContactMetric {
  automatic,  ///< inertia where no contact moves more than its own vertex, m_i (A^-1)_ii >= 1/2, else full
  full,       ///< W = H A^-1 H^T: contacts are met to the tolerance in every iteration
  inertia,    ///< W = H M^-1 H^T, the published "lite": cheap, safe only where every vertex carries itself
};

struct ProjectiveSettings {
  double time_step = 0.01;  ///< h [s]
  int iterations = 30;      ///< local-global iterations a step, the budget
  double tolerance = 1e-3;  ///< on the relative residual |r| / |M g|; reached, the step ends early
  double contact_tolerance =
      1e-8;              ///< on |min(c, r lambda_n)| and its friction like, for a converged step [m]
  int acceleration = 5;  ///< depth of the Anderson acceleration, 0 for none
  ContactMetric metric = ContactMetric::automatic;
  int dense_contacts = 300;  ///< up to this number the named dense solver, above it the matrix-free one
  double tangent_angle = 0;  ///< angle of the tangent basis about the normal [rad]; no result depends on it
  ConstraintSettings constraints{};
};

struct ProjectiveReport : StepReport {
  double cone_violation = 0;                   ///< max(|lambda_t| - mu lambda_n) [N]
  ContactMetric metric = ContactMetric::full;  ///< the one used
  int contacts = 0;                            ///< vertices against obstacles in the last iteration
  int constraint_iterations = 0;               ///< Newton steps on the multipliers, summed
  std::string warning;                         ///< one line, empty where there is nothing to say
};

/// Steps environments of one Sheet by implicit Euler with projective dynamics. An iteration has exact local
/// steps p_e = F_e - P(F_e) / w and one global step with a constant prefactored A. Within it the non-smooth
/// Newton method on the multipliers solves contact and friction. Grasps and supports are bilateral rows,
/// eliminated exactly.
///
/// With these local steps the global step A x' = M s + h^2 sum w a G^T p + h^2 H^T lambda reads
/// x' = x - A^-1 (h^2 r(x) - h^2 H^T lambda) with r the force residual. Whatever A is, its fixed point is
/// implicit Euler of the named energy, which Solver finds by Newton's method. Bouaziz et al. 2014; Zeng et
/// al. 2025.
class ProjectiveSolver {
 public:
  ProjectiveSolver(const Sheet& sheet, const ProjectiveSettings& settings);
  ProjectiveSolver(std::shared_ptr<const SheetPlan> plan, const ProjectiveSettings& settings);
  ~ProjectiveSolver();
  /// A copy goes on as the one it is of, bitwise.
  ProjectiveSolver(const ProjectiveSolver&);
  ProjectiveSolver(ProjectiveSolver&&) noexcept;
  ProjectiveSolver& operator=(ProjectiveSolver) noexcept;

  /// Advances environment.state by one time step. The state returned is the iterate whose residual is
  /// reported.
  ProjectiveReport step(Environment& environment);

  /// The contacts at the end of the last step of the environment that took it, as Solver::contacts.
  std::vector<ContactForce> contacts(const Environment& environment) const;

 private:
  struct Workspace;
  std::unique_ptr<Workspace> workspace_;
};

}  // namespace flash::sim
