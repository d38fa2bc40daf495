#pragma once
#include <Eigen/Core>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/law/constraint_row.h"

namespace flash::sim {

/// How the linear system of a non-smooth Newton step is solved. CR is the conjugate residual method,
/// P..._JACOBI its version preconditioned by the diagonal. matrix_free applies W through the factor of A and
/// never forms it.
enum class DualSolver {
  dense_cholesky_eigen,
  dense_cg,
  dense_pcg_jacobi,
  dense_cr,
  dense_pcr_jacobi,
  matrix_free,
};

/// The names scene files use: DENSE_CHOLESKY_EIGEN, DENSE_CG, DENSE_PCG_JACOBI, DENSE_CR, DENSE_PCR_JACOBI,
/// MATRIX_FREE.
const std::vector<std::string>& dual_solver_names();
/// Reads a solver's name; throws data::InputError with the known names.
DualSolver dual_solver_from_name(std::string_view name);
const std::string& name_of(DualSolver solver);

struct DualSolverSettings {
  DualSolver solver = DualSolver::dense_cholesky_eigen;
  double tolerance = 1e-10;  ///< on |b - K x| / |b|; the Cholesky factor is refined once or twice to reach it
  int max_iterations = 0;    ///< iterations of the iterative solvers; 0: ten times the rows, plus 100
  double regularization =
      1e-12;  ///< added to each diagonal entry, relative to it; K stays solvable where rows repeat
};

struct DualSolution {
  Eigen::VectorXd x;
  int iterations = 0;            ///< matrix-vector products, or refinements of the factor's solution
  double relative_residual = 0;  ///< |b - K x| / |b| of the regularised K, evaluated, not from a recursion
  bool converged = false;
};

/// y = K x without K: applies a symmetric positive semi-definite operator.
using Operator = std::function<void(const Eigen::VectorXd& x, Eigen::VectorXd& y)>;

/// K x = b, K symmetric positive semi-definite. MATRIX_FREE on a given matrix is DENSE_PCR_JACOBI.
DualSolution solve_symmetric(const Eigen::MatrixXd& K, const Eigen::VectorXd& b,
                             const DualSolverSettings& settings);
/// Solves with K as an operator and its diagonal: the Jacobi-preconditioned conjugate residual method.
DualSolution solve_symmetric(const Operator& K, const Eigen::VectorXd& diagonal, const Eigen::VectorXd& b,
                             const DualSolverSettings& settings);

/// dlambda of (Omega W + E) dlambda = rhs / h^2, the exact Newton system of the rows.
///
/// Solved in the symmetric form (S W S + E) y = S^-1 rhs / h^2 with S = Omega^(1/2), dlambda = S y; rows with
/// omega = 0 are known, dlambda = rhs / (h^2 E), and move to the right-hand side. Where every omega is 0 or 1
/// the matrix is the published Omega W Omega + E; unlike that one it stays exact for the fractional weights
/// of Fischer-Burmeister.
DualSolution solve_dual(const Eigen::MatrixXd& W, const std::vector<ConstraintRow>& rows, double h,
                        const DualSolverSettings& settings);
DualSolution solve_dual(const Operator& W, const Eigen::VectorXd& diagonal,
                        const std::vector<ConstraintRow>& rows, double h, const DualSolverSettings& settings);

}  // namespace flash::sim
