#pragma once
#include <memory>
#include <vector>

#include "sim/newton/krylov.h"
#include "sim/plan/sheet_plan.h"
#include "sim/step/contact_set.h"
#include "sim/step/layer_contact.h"

namespace flash::sim {

/// The bending of a body with the rigidity that it has in a step [N m].
struct ScaledBending {
  const BendingOperator& bending;
  double rigidity;
};

/// The stiffness between four vertices that touch [N/m]: as stiffness_of says, less `coupling` n^T.
struct TouchStiffness {
  const LayerTouch& touch;
  Symmetric3 stiffness;
  Vector3<double> coupling{};  ///< as friction_coupling_of says, or zero
};

/// The matrix of a Newton iteration, its preconditioner and the solution of its linear problem.
///
/// A direction needs a digit or two, so single precision does, at half the traffic. The condition is that
/// rounding the matrix changes its least eigenvalue by little: that of the mass, m / h^2, bounds it from
/// below.
class NewtonMatrix {
 public:
  explicit NewtonMatrix(std::shared_ptr<const SheetPlan> plan);

  /// Factorizes the preconditioner, which has to be positive definite. Returns false where it is not.
  bool factorize(const BlockValues<double>& positive) { return factor_.factorize(positive); }

  /// The matrix: blocks, the stiffness of quadratic bending models, and that of layers that touch. `sparse`:
  /// all blocks across a hinge are zero. `least_eigenvalue`: of the mass [N/m].
  void assign(const BlockValues<double>& blocks, bool sparse, const std::vector<ScaledBending>& bending,
              double least_eigenvalue, const std::vector<TouchStiffness>& layers = {});

  /// Sets `direction` to the solution of matrix * direction = -gradient over the free directions, and to the
  /// constraints' corrections in the others. It is solved to a residual of `tolerance` [N] or a share of the
  /// first. `goes_on`: from `direction` as it is, that of the last problem, which had other contacts, and to
  /// what was enough for that one; but for layers that touch. Adds to `force` what the direction changes.
  /// Returns the number of solves with the factor.
  int solve(const ContactSet& contacts, const data::Points& gradient, double tolerance, bool goes_on,
            data::Points& direction, data::Points& force);

  /// Solves likewise where friction grows with the normal forces. The matrix is L A P with the free
  /// directions P, L = P + C and the `couplings` C of the constraints (friction_couplings). It is not
  /// symmetric: GMRES.
  int solve_coupled(const ContactSet& contacts, const std::vector<Eigen::Matrix3d>& couplings,
                    const data::Points& gradient, double tolerance, data::Points& direction,
                    data::Points& force);

 private:
  template <typename Scalar>
  RestrictedProblem<Scalar> restricted(SheetProduct<Scalar>& product, const ContactSet& contacts,
                                       const data::Points& gradient, double tolerance);
  /// Starts a problem from a direction, as far as it may move freely.
  template <typename Scalar>
  void start_from(const data::Points& direction, RestrictedProblem<Scalar>& problem) const;
  template <typename Scalar>
  int take(const KrylovSolution<Scalar>& solution, data::Points& direction, data::Points& force) const;

  /// Calls work(product) with the product of the precision that does.
  template <typename Work>
  auto with_product(const Work& work) {
    return single_ ? work(single_product_) : work(double_product_);
  }

  std::shared_ptr<const SheetPlan> plan_;
  BlockCholesky<float> factor_;
  bool single_ = true;         ///< whether single precision does
  double first_residual_ = 0;  ///< of the last problem that did not go on [N]
  bool layered_ = false;       ///< whether layers touch, whose pairs the preconditioner does not know
  SheetProduct<float> single_product_;
  SheetProduct<double> double_product_;
};

}  // namespace flash::sim
