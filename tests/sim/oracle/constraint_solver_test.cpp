#include "sim/oracle/constraint_solver.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "data/files/error.h"
#include "sim/oracle/constraint_newton.h"

namespace flash::sim {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

const std::vector<DualSolver> all_solvers = {DualSolver::dense_cholesky_eigen, DualSolver::dense_cg,
                                             DualSolver::dense_pcg_jacobi,     DualSolver::dense_cr,
                                             DualSolver::dense_pcr_jacobi,     DualSolver::matrix_free};

MatrixXd random_spd(int n, double condition, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const MatrixXd G = MatrixXd::NullaryExpr(n, n, [&] { return normal(random); });
  const MatrixXd Q = Eigen::HouseholderQR<MatrixXd>(G).householderQ();
  const VectorXd d =
      VectorXd::NullaryExpr(n, [&](Eigen::Index i) { return std::pow(condition, -double(i) / (n - 1)); });
  return Q * d.asDiagonal() * Q.transpose();
}

VectorXd random_vector(int n, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  return VectorXd::NullaryExpr(n, [&] { return normal(random); });
}

DualSolution solve(DualSolver solver, const MatrixXd& K, const VectorXd& b, DualSolverSettings settings) {
  settings.solver = solver;
  if (solver != DualSolver::matrix_free) return solve_symmetric(K, b, settings);
  const Operator apply = [&](const VectorXd& x, VectorXd& y) { y = K * x; };
  return solve_symmetric(apply, K.diagonal(), b, settings);
}

TEST(DualSolver, EachAgreesWithADirectSolveToItsTolerance) {
  DualSolverSettings settings;
  settings.regularization = 0;
  for (const double tolerance : {1e-4, 1e-10})
    for (const int n : {1, 7, 60, 150})
      for (const DualSolver solver : all_solvers) {
        settings.tolerance = tolerance;
        const double condition = n > 1 ? 1e4 : 1;
        const MatrixXd K = random_spd(std::max(n, 2), condition, n).topLeftCorner(n, n);
        const VectorXd b = random_vector(n, n + 1);
        const VectorXd exact = K.partialPivLu().solve(b);
        const DualSolution found = solve(solver, K, b, settings);
        EXPECT_TRUE(found.converged) << name_of(solver) << " n=" << n;
        EXPECT_LE((b - K * found.x).norm(), tolerance * b.norm() * (1 + 1e-6)) << name_of(solver);
        EXPECT_NEAR(found.relative_residual, (b - K * found.x).norm() / b.norm(), 1e-3 * tolerance + 1e-14);
        // |x - K^-1 b| <= |K^-1| |r|, |K^-1| = condition here; the direct solve's own rounding is added.
        EXPECT_LE((found.x - exact).norm(), condition * (tolerance + 1e-14) * b.norm() * 1.001)
            << name_of(solver);
      }
}

TEST(DualSolver, BadScalesAreSolvedOrReported) {
  const int n = 60;
  const MatrixXd K0 = random_spd(n, 1e2, 5);
  const VectorXd scale =
      VectorXd::NullaryExpr(n, [](Eigen::Index i) { return std::pow(10.0, double((i * 7) % 9) - 4); });
  const MatrixXd K = scale.asDiagonal() * K0 * scale.asDiagonal();
  const VectorXd exact = scale.cwiseInverse().cwiseProduct(random_vector(n, 6));
  const VectorXd b = K * exact;
  for (const DualSolver solver : all_solvers) {
    DualSolverSettings settings;
    settings.tolerance = 1e-9;
    const DualSolution found = solve(solver, K, b, settings);
    const double residual = (b - K * found.x).norm() / b.norm();
    EXPECT_NEAR(found.relative_residual, residual, 1e-11) << name_of(solver);
    EXPECT_EQ(found.converged, found.relative_residual <= settings.tolerance) << name_of(solver);
    // Entries over 16 decades are out of reach of the methods that do not rescale: they have to say so.
    const bool scaled = solver != DualSolver::dense_cg && solver != DualSolver::dense_cr;
    EXPECT_TRUE(found.converged || !scaled) << name_of(solver) << " " << residual;
    if (solver == DualSolver::dense_cholesky_eigen) {
      // Every component, large or small: the condition of K0, 1e2, times the regularisation, 1e-12, with
      // room.
      EXPECT_LE(scale.cwiseProduct(found.x - exact).cwiseAbs().maxCoeff(), 1e-8);
    }
  }
}

TEST(DualSolver, RepeatedRowsAreSolvedByTheRegularisation) {
  const int n = 12;
  const MatrixXd B = random_spd(n, 10, 8);
  MatrixXd K(2 * n, 2 * n);  // every row twice
  K << B, B, B, B;
  VectorXd b(2 * n);
  b << random_vector(n, 9), VectorXd::Zero(n);
  b.tail(n) = b.head(n);
  const VectorXd exact = B.partialPivLu().solve(b.head(n));
  for (const DualSolver solver : all_solvers) {
    DualSolverSettings settings;
    settings.tolerance = 1e-8;
    const DualSolution found = solve(solver, K, b, settings);
    EXPECT_TRUE(found.converged) << name_of(solver);
    EXPECT_LE((found.x.head(n) + found.x.tail(n) - exact).norm(), 1e-6 * exact.norm()) << name_of(solver);
  }
}

TEST(DualSolver, ZeroRightHandSideGivesZero) {
  const MatrixXd K = random_spd(5, 10, 3);
  for (const DualSolver solver : all_solvers) {
    const DualSolution found = solve(solver, K, VectorXd::Zero(5), {});
    EXPECT_TRUE(found.converged);
    EXPECT_EQ(found.x.norm(), 0);
  }
}

TEST(DualSolver, AnIterationLimitIsReported) {
  DualSolverSettings settings;
  settings.max_iterations = 3;
  const MatrixXd K = random_spd(60, 1e6, 3);
  for (const DualSolver solver : all_solvers) {
    if (solver == DualSolver::dense_cholesky_eigen) continue;
    const DualSolution found = solve(solver, K, random_vector(60, 4), settings);
    EXPECT_FALSE(found.converged);
    EXPECT_GT(found.relative_residual, settings.tolerance);
  }
}

TEST(DualSolver, RowsGiveTheExactNewtonStepWhateverTheirWeights) {
  const int n = 30;
  const double h = 0.01;
  const MatrixXd W = random_spd(n, 1e3, 11);
  std::mt19937 random(12);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<ConstraintRow> rows;
  for (int i = 0; i < n; ++i) {
    if (i % 3 == 0)
      rows.push_back({0, 0.1 + unit(random), 1e-3 * (unit(random) - 0.5)});
    else if (i % 3 == 1)
      rows.push_back({1, 0, 1e-3 * (unit(random) - 0.5)});
    else
      rows.push_back({unit(random), 0.1 * unit(random), 1e-3 * (unit(random) - 0.5)});
  }
  MatrixXd unsymmetric = W;
  VectorXd rhs(n);
  for (int i = 0; i < n; ++i) {
    unsymmetric.row(i) *= rows[i].omega;
    unsymmetric(i, i) += rows[i].compliance;
    rhs[i] = rows[i].rhs / (h * h);
  }
  const VectorXd exact = unsymmetric.partialPivLu().solve(rhs);
  for (const DualSolver solver : all_solvers) {
    DualSolverSettings settings;
    settings.solver = solver;
    const DualSolution dense = solve_dual(W, rows, h, settings);
    const Operator apply = [&](const VectorXd& x, VectorXd& y) { y = W * x; };
    const DualSolution free = solve_dual(apply, W.diagonal(), rows, h, settings);
    EXPECT_LE((dense.x - exact).norm(), 1e-6 * exact.norm()) << name_of(solver);
    EXPECT_LE((free.x - exact).norm(), 1e-6 * exact.norm());
  }
}

TEST(DualSolver, NamesRoundTripAndMisspellingsAreNamed) {
  for (const DualSolver solver : all_solvers) EXPECT_EQ(dual_solver_from_name(name_of(solver)), solver);
  try {
    dual_solver_from_name("DENSE_CGG");
    FAIL();
  } catch (const data::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("DENSE_PCG_JACOBI"), std::string::npos);
  }
}

/// Contacts with a dense metric as a sheet has it: near neighbours coupled, three rows a contact.
ContactProblem random_contacts(int contacts, double friction, unsigned seed) {
  ContactProblem problem;
  const int n = 3 * contacts;
  problem.W = 100 * random_spd(n, 30, seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  problem.free_gap = VectorXd::NullaryExpr(
      n, [&](Eigen::Index i) { return i % 3 == 0 ? 1e-3 * (unit(random) - 0.3) : 1e-3 * unit(random); });
  problem.friction = VectorXd::Constant(contacts, friction);
  return problem;
}

/// Projected Gauss-Seidel on the discs, run until it stands still: a different method for the same law.
VectorXd gauss_seidel(const ContactProblem& problem) {
  const double h2 = problem.time_step * problem.time_step;
  VectorXd lambda = VectorXd::Zero(problem.free_gap.size());
  for (int sweep = 0; sweep < 20000; ++sweep) {
    double change = 0;
    for (Eigen::Index k = 0; k < problem.friction.size(); ++k) {
      for (int block : {0, 1}) {
        const Eigen::Index first = 3 * k + block;
        const Eigen::Index rows = block == 0 ? 1 : 2;
        const VectorXd c =
            problem.free_gap.segment(first, rows) + h2 * problem.W.middleRows(first, rows) * lambda;
        const double scale = problem.W.block(first, first, rows, rows).eigenvalues().real().maxCoeff() * h2;
        VectorXd next = lambda.segment(first, rows) - c / scale;
        if (block == 0)
          next[0] = std::max(next[0], 0.0);
        else if (const double limit = problem.friction[k] * lambda[3 * k]; next.norm() > limit)
          next *= limit / next.norm();
        change = std::max(change, (next - lambda.segment(first, rows)).norm());
        lambda.segment(first, rows) = next;
      }
    }
    if (change < 1e-15) break;
  }
  return lambda;
}

TEST(ConstraintNewton, AgreesWithProjectedGaussSeidel) {
  for (const double friction : {0.0, 0.3, 1.0})
    for (const auto complementarity : {Complementarity::minimum_map, Complementarity::fischer_burmeister})
      for (const auto friction_row : {FrictionRow::newton, FrictionRow::fixed_point})
        for (unsigned seed = 1; seed <= 6; ++seed) {
          const ContactProblem problem = random_contacts(12, friction, seed);
          const VectorXd expected = gauss_seidel(problem);
          ConstraintSettings settings;
          settings.complementarity = complementarity;
          settings.friction = friction_row;
          settings.iterations = 200;
          settings.tolerance = 1e-12;
          VectorXd lambda = VectorXd::Zero(expected.size());
          const ConstraintReport report = solve_contacts(problem, settings, lambda);
          EXPECT_TRUE(report.converged) << friction << " " << seed << " " << report.violation;
          EXPECT_LE((lambda - expected).norm(), 1e-6 * expected.norm())
              << friction << " seed " << seed << " after " << report.iterations;
        }
}

}  // namespace
}  // namespace flash::sim
