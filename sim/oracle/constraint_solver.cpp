#include "sim/oracle/constraint_solver.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "data/files/error.h"

namespace flash::sim {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

double relative(const VectorXd& residual, double size) { return size > 0 ? residual.norm() / size : 0.0; }

/// Conjugate gradients or conjugate residuals on P^-1 K x = P^-1 b, P diagonal. The recursion drifts from the
/// true residual on badly scaled systems, so the true one decides. The method starts again from where it
/// stands until a restart no longer gains.
class Krylov {
 public:
  Krylov(const Operator& K, const VectorXd& preconditioner, const VectorXd& b,
         const DualSolverSettings& settings)
      : K_(K), P_(preconditioner), b_(b), settings_(settings), size_(b.norm()) {
    limit_ = settings.max_iterations > 0 ? settings.max_iterations : 10 * static_cast<int>(b.size()) + 100;
  }

  template <typename Cycle>
  DualSolution solve(Cycle cycle) {
    DualSolution solution;
    solution.x = VectorXd::Zero(b_.size());
    VectorXd best = solution.x;
    double best_residual = size_ > 0 ? 1.0 : 0.0;
    while (best_residual > settings_.tolerance && count_ < limit_) {
      solution.x = best;
      (this->*cycle)(solution.x);
      const double residual = relative(b_ - apply(solution.x), size_);
      const bool gained = residual < 0.5 * best_residual;
      if (residual < best_residual) {
        best_residual = residual;
        best = solution.x;
      }
      if (!gained) break;
    }
    solution.x = best;
    solution.iterations = count_;
    solution.relative_residual = best_residual;
    solution.converged = best_residual <= settings_.tolerance;
    return solution;
  }

  void conjugate_gradient(VectorXd& x) {
    VectorXd r = b_ - apply(x);
    VectorXd z = r.cwiseQuotient(P_), p = z;
    double rz = r.dot(z);
    while (relative(r, size_) > 0.5 * settings_.tolerance && count_ < limit_) {
      const VectorXd q = apply(p);
      const double curvature = p.dot(q);
      if (!(curvature > 0)) return;
      const double step = rz / curvature;
      x += step * p;
      r -= step * q;
      z = r.cwiseQuotient(P_);
      const double next = r.dot(z);
      p = z + (next / rz) * p;
      rz = next;
    }
  }

  /// The conjugate residual method (Stiefel 1955) in the P^-1 inner product: minimizes |r|_{P^-1} over the
  /// Krylov space.
  void conjugate_residual(VectorXd& x) {
    VectorXd r = b_ - apply(x);
    VectorXd z = r.cwiseQuotient(P_), p = z;
    VectorXd Kz = apply(z), Kp = Kz;
    double zKz = z.dot(Kz);
    while (relative(r, size_) > 0.5 * settings_.tolerance && count_ < limit_) {
      const VectorXd q = Kp.cwiseQuotient(P_);
      const double curvature = Kp.dot(q);
      if (!(curvature > 0) || !(zKz > 0)) return;
      const double step = zKz / curvature;
      x += step * p;
      r -= step * Kp;
      z -= step * q;
      Kz = apply(z);
      const double next = z.dot(Kz);
      const double ratio = next / zKz;
      p = z + ratio * p;
      Kp = Kz + ratio * Kp;
      zKz = next;
    }
  }

 private:
  VectorXd apply(const VectorXd& x) {
    ++count_;
    VectorXd y(x.size());
    K_(x, y);
    return y;
  }

  const Operator& K_;
  const VectorXd& P_;
  const VectorXd& b_;
  const DualSolverSettings& settings_;
  double size_;
  int limit_;
  int count_ = 0;
};

DualSolution solve_by_cholesky(const MatrixXd& K, const VectorXd& b, const DualSolverSettings& settings) {
  DualSolution solution;
  solution.x = VectorXd::Zero(b.size());
  const double size = b.norm();
  // Equilibrated, a factor that fails has repeated rows, whatever the scales: it gets the least shift that
  // succeeds, and refinement against K itself takes the shift out of the part of the solution that K
  // determines.
  const VectorXd scale = K.diagonal().unaryExpr([](double d) { return d > 0 ? 1 / std::sqrt(d) : 1.0; });
  const MatrixXd scaled = scale.asDiagonal() * K * scale.asDiagonal();
  Eigen::LLT<MatrixXd> factor(scaled);
  for (double shift = 1e-14; factor.info() != Eigen::Success && shift < 1; shift *= 10)
    factor.compute(scaled + shift * MatrixXd::Identity(K.rows(), K.rows()));
  if (factor.info() != Eigen::Success) {
    solution.relative_residual = size > 0 ? 1.0 : 0.0;
    return solution;
  }
  VectorXd residual = b;
  solution.relative_residual = size > 0 ? 1.0 : 0.0;
  for (int i = 0; i < 10 && solution.relative_residual > settings.tolerance; ++i) {
    const VectorXd next = solution.x + scale.cwiseProduct(factor.solve(scale.cwiseProduct(residual)));
    const VectorXd next_residual = b - K * next;
    const double value = relative(next_residual, size);
    if (!(value < solution.relative_residual)) break;
    solution.x = next;
    residual = next_residual;
    solution.relative_residual = value;
    ++solution.iterations;
  }
  solution.converged = solution.relative_residual <= settings.tolerance;
  return solution;
}

/// The rows split into those with weight (kept, scaled by sqrt(omega)) and those whose dlambda is known.
struct ScaledRows {
  VectorXd scale;  ///< sqrt(omega), 0 for known rows
  VectorXd known;  ///< dlambda of the known rows, 0 else
  VectorXd E;      ///< compliance [1/kg]
};

ScaledRows scaled_rows(const std::vector<ConstraintRow>& rows, double h) {
  const Eigen::Index n = static_cast<Eigen::Index>(rows.size());
  ScaledRows s{VectorXd::Zero(n), VectorXd::Zero(n), VectorXd::Zero(n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const ConstraintRow& row = rows[i];
    s.E[i] = row.compliance;
    if (row.omega > 1e-14)
      s.scale[i] = std::sqrt(row.omega);
    else
      s.known[i] = row.compliance > 0 ? row.rhs / (h * h * row.compliance) : 0.0;
  }
  return s;
}

VectorXd scaled_right_hand_side(const std::vector<ConstraintRow>& rows, const ScaledRows& s,
                                const VectorXd& W_known, double h) {
  VectorXd b = VectorXd::Zero(s.scale.size());
  for (Eigen::Index i = 0; i < b.size(); ++i)
    if (s.scale[i] > 0) b[i] = rows[i].rhs / (h * h * s.scale[i]) - s.scale[i] * W_known[i];
  return b;
}

}  // namespace

const std::vector<std::string>& dual_solver_names() {
  static const std::vector<std::string> names = {
      "DENSE_CHOLESKY_EIGEN", "DENSE_CG", "DENSE_PCG_JACOBI", "DENSE_CR", "DENSE_PCR_JACOBI", "MATRIX_FREE"};
  return names;
}

DualSolver dual_solver_from_name(std::string_view name) {
  const auto& names = dual_solver_names();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return static_cast<DualSolver>(found - names.begin());
  std::string known;
  for (const std::string& n : names) known += (known.empty() ? "" : ", ") + n;
  throw data::InputError("constraint solver: unknown name \"" + std::string(name) + "\", expected one of " +
                         known);
}

const std::string& name_of(DualSolver solver) {
  return dual_solver_names()[static_cast<std::size_t>(solver)];
}

DualSolution solve_symmetric(const MatrixXd& K, const VectorXd& b, const DualSolverSettings& settings) {
  MatrixXd regular = K;
  regular.diagonal() *= 1 + settings.regularization;
  const Operator apply = [&](const VectorXd& x, VectorXd& y) { y.noalias() = regular * x; };
  const VectorXd identity = VectorXd::Ones(b.size());
  const VectorXd jacobi = regular.diagonal().unaryExpr([](double d) { return d > 0 ? d : 1.0; });
  switch (settings.solver) {
    case DualSolver::dense_cholesky_eigen:
      return solve_by_cholesky(regular, b, settings);
    case DualSolver::dense_cg:
      return Krylov(apply, identity, b, settings).solve(&Krylov::conjugate_gradient);
    case DualSolver::dense_pcg_jacobi:
      return Krylov(apply, jacobi, b, settings).solve(&Krylov::conjugate_gradient);
    case DualSolver::dense_cr:
      return Krylov(apply, identity, b, settings).solve(&Krylov::conjugate_residual);
    case DualSolver::dense_pcr_jacobi:
    case DualSolver::matrix_free:
      break;
  }
  return Krylov(apply, jacobi, b, settings).solve(&Krylov::conjugate_residual);
}

DualSolution solve_symmetric(const Operator& K, const VectorXd& diagonal, const VectorXd& b,
                             const DualSolverSettings& settings) {
  const VectorXd jacobi =
      diagonal.unaryExpr([&](double d) { return d > 0 ? (1 + settings.regularization) * d : 1.0; });
  const Operator regular = [&](const VectorXd& x, VectorXd& y) {
    K(x, y);
    y += settings.regularization * diagonal.cwiseProduct(x);
  };
  return Krylov(regular, jacobi, b, settings).solve(&Krylov::conjugate_residual);
}

DualSolution solve_dual(const MatrixXd& W, const std::vector<ConstraintRow>& rows, double h,
                        const DualSolverSettings& settings) {
  const ScaledRows s = scaled_rows(rows, h);
  MatrixXd K = s.scale.asDiagonal() * W * s.scale.asDiagonal();
  K.diagonal() += s.E;
  DualSolution solution = solve_symmetric(K, scaled_right_hand_side(rows, s, W * s.known, h), settings);
  solution.x = s.scale.cwiseProduct(solution.x) + s.known;
  return solution;
}

DualSolution solve_dual(const Operator& W, const VectorXd& diagonal, const std::vector<ConstraintRow>& rows,
                        double h, const DualSolverSettings& settings) {
  const ScaledRows s = scaled_rows(rows, h);
  VectorXd W_known(s.known.size());
  W(s.known, W_known);
  const Operator K = [&](const VectorXd& x, VectorXd& y) {
    W(s.scale.cwiseProduct(x), y);
    y = s.scale.cwiseProduct(y) + s.E.cwiseProduct(x);
  };
  const VectorXd K_diagonal = s.scale.cwiseAbs2().cwiseProduct(diagonal) + s.E;
  DualSolution solution =
      solve_symmetric(K, K_diagonal, scaled_right_hand_side(rows, s, W_known, h), settings);
  solution.x = s.scale.cwiseProduct(solution.x) + s.known;
  return solution;
}

}  // namespace flash::sim
