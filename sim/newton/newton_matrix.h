#pragma once
#include <memory>
#include <vector>

#include "sim/cpu/sheet_product.h"
#include "sim/plan/sheet_plan.h"
#include "sim/step/contact_set.h"

namespace flash::sim {

/// The matrix of a Newton iteration, its preconditioner and the solution of its linear problem by conjugate
/// gradients, in elimination order.
///
/// A direction needs a digit or two, so that single precision does, at half the traffic, as long as rounding
/// the matrix changes its least eigenvalue by little: that of the mass, m / h^2, bounds it from below.
class NewtonMatrix {
 public:
  explicit NewtonMatrix(std::shared_ptr<const SheetPlan> plan);

  /// Factorizes the preconditioner, which has to be positive definite. Returns false where it is not.
  bool factorize(const BlockValues<double>& positive) { return factor_.factorize(positive); }

  /// The matrix: blocks, and `rigidity` times the stiffness of a quadratic bending model. `sparse`: all
  /// blocks across a hinge are zero. `least_eigenvalue`: of the mass [N/m].
  void assign(const BlockValues<double>& blocks, bool sparse, const BendingOperator& bending, double rigidity,
              double least_eigenvalue);

  /// Adds to `direction` the solution of matrix * direction = -gradient over the free directions of the
  /// constraints, whose corrections it makes, until the residual has fallen to `tolerance` [N] or a tenth, or
  /// the matrix curves down (Steihaug 1983). Adds to `force` what the direction changes. Returns the number
  /// of solves with the factor.
  int solve(const ContactSet& contacts, const data::Points& gradient, double tolerance,
            data::Points& direction, data::Points& force);

  /// The same with friction forces that grow with the normal forces: of the matrix L A P, P the free
  /// directions and L = P + C, with the `couplings` C of the first of the constraints (friction_couplings).
  /// Not symmetric: by GMRES (Saad and Schultz 1986).
  int solve_coupled(const ContactSet& contacts, const std::vector<Eigen::Matrix3d>& couplings,
                    const data::Points& gradient, double tolerance, data::Points& direction,
                    data::Points& force);

 private:
  template <typename Scalar>
  int generalized_minimal_residual(SheetProduct<Scalar>& product, const ContactSet& contacts,
                                   const std::vector<Eigen::Matrix3d>& couplings,
                                   const data::Points& gradient, double tolerance, data::Points& direction,
                                   data::Points& force);

  template <typename Scalar>
  int conjugate_gradients(SheetProduct<Scalar>& product, const ContactSet& contacts,
                          const data::Points& gradient, double tolerance, data::Points& direction,
                          data::Points& force);

  std::shared_ptr<const SheetPlan> plan_;
  BlockCholesky<float> factor_;
  bool single_ = true;
  SheetProduct<float> single_product_;
  SheetProduct<double> double_product_;
};

}  // namespace flash::sim
