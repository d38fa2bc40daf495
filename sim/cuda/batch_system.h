#pragma once
#include <memory>
#include <vector>

#include "data/mesh/mesh.h"
#include "sim/cuda/environment_numbers.h"
#include "sim/cuda/layout/front_plan.h"
#include "sim/plan/sheet_plan.h"

namespace flash::sim::cuda {

/// The linear problems of the Newton iterations of many environments of one sheet, on the device: elastic
/// energies and their derivatives, the matrix, its preconditioner and conjugate gradients. A block of threads
/// works on an environment from start to end and then takes another one, so that none waits for the others;
/// what an environment gets depends on its own numbers alone, bitwise. Only quadratic bending models, in
/// single precision but for energies and gradients.
///
/// Calls queue work and return; what reads results waits for them. Throws std::runtime_error with the
/// device's message. `set_...` and results by environment, vertices as in the mesh.
class BatchSystem {
 public:
  /// `plan` is read here alone.
  BatchSystem(const SheetPlan& plan, const BendingOperator& bending,
              const std::vector<EnvironmentNumbers>& environments,
              FactorPrecision precision = FactorPrecision::single, const FrontSettings& fronts = {});
  ~BatchSystem();
  BatchSystem(BatchSystem&&) noexcept;

  int size() const;
  const FrontPlan& fronts() const;

  void set_positions(int environment, const data::Points& positions);  ///< [m]
  /// Right-hand sides of solves and products, gradients of linear problems.
  void set_vector(int environment, const data::Points& vector);
  void set_restrictions(int environment, const std::vector<VertexRestriction>& restrictions);

  void evaluate();                 ///< energies and gradients at the positions
  void assemble_matrix();          ///< the exact Hessian of membrane and inertia; bending is never assembled
  void assemble_preconditioner();  ///< without negative eigenvalues, and with the stand-in for bending
  void factorize();                ///< the preconditioner
  void multiply();                 ///< results <- matrix * vectors
  void solve();                    ///< results <- preconditioner^-1 * vectors
  /// results <- directions with matrix * direction = -vector over the free directions, as
  /// NewtonMatrix::solve; until the residual has fallen to `tolerance` [N] or a tenth.
  void find_directions(double tolerance);
  void synchronize();

  data::Points result(int environment) const;
  data::Points change(int environment) const;  ///< matrix * direction
  data::Points gradient(int environment) const;
  std::vector<ElasticEnergies> energies() const;
  std::vector<bool> factorized() const;  ///< whether all pivots were positive
  std::vector<int> solves() const;       ///< of find_directions

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace flash::sim::cuda
