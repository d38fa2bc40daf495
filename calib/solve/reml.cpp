#include "calib/solve/reml.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "data/numbers/chi_square.h"

namespace flash::calib {
namespace {

double log_determinant(const Eigen::LDLT<Eigen::MatrixXd>& ldlt) {
  return ldlt.vectorD().array().abs().max(1e-300).log().sum();
}

/// How far log sigma is from what is usual, in units of its spread.
double surprise(const NoisePrior& prior, std::size_t component, double sigma) {
  return prior.spread > 0 ? std::log(sigma / prior.usual[component]) / prior.spread : 0;
}

/// Likewise for a ratio.
double surprise(const NoiseRatio& ratio, const std::vector<double>& sigmas) {
  return std::log(sigmas[ratio.over] / (ratio.usual * sigmas[ratio.under])) / ratio.spread;
}

/// Components of which neither residuals nor another component tell anything.
std::vector<bool> untold(const LinearModel& model) {
  std::vector<bool> result(static_cast<std::size_t>(model.components), true);
  for (const GramBlock& block : model.blocks)
    if (block.count > 0) result[static_cast<std::size_t>(block.component)] = false;
  for (const NoiseRatio& ratio : model.noise.ratios) result[ratio.over] = result[ratio.under] = false;
  return result;
}

/// d(deviance) / d(log sigma) for each component.
Eigen::VectorXd gradient_of(const LinearModel& model, const LinearSolution& solution,
                            const std::vector<double>& sigmas) {
  Eigen::VectorXd gradient(solution.squares.size());
  for (Eigen::Index c = 0; c < gradient.size(); ++c) {
    const double variance = sigmas[static_cast<std::size_t>(c)] * sigmas[static_cast<std::size_t>(c)];
    gradient[c] = 2 * (solution.redundancy[c] - solution.squares[c] / variance);
    if (model.noise.spread > 0)
      gradient[c] += 2 *
                     surprise(model.noise, static_cast<std::size_t>(c), sigmas[static_cast<std::size_t>(c)]) /
                     model.noise.spread;
  }
  for (const NoiseRatio& ratio : model.noise.ratios) {
    const double pull = 2 * surprise(ratio, sigmas) / ratio.spread;
    gradient[static_cast<Eigen::Index>(ratio.over)] += pull;
    gradient[static_cast<Eigen::Index>(ratio.under)] -= pull;
  }
  return gradient;
}

std::vector<double> scaled(const std::vector<double>& sigmas, const Eigen::VectorXd& log_step,
                           const std::vector<double>& floor) {
  std::vector<double> result = sigmas;
  for (std::size_t c = 0; c < sigmas.size(); ++c)
    result[c] = std::max(floor[c], sigmas[c] * std::exp(log_step[static_cast<Eigen::Index>(c)]));
  return result;
}

/// Central differences of the gradient on log sigma.
Eigen::MatrixXd hessian_of(const LinearModel& model, const std::vector<double>& sigmas) {
  constexpr double kStep = 1e-4;
  const auto count = static_cast<Eigen::Index>(sigmas.size());
  Eigen::MatrixXd hessian(count, count);
  for (Eigen::Index c = 0; c < count; ++c) {
    std::vector<double> up = sigmas, down = sigmas;
    up[static_cast<std::size_t>(c)] *= std::exp(kStep);
    down[static_cast<std::size_t>(c)] *= std::exp(-kStep);
    hessian.col(c) = (gradient_of(model, solve_linear(model, up), up) -
                      gradient_of(model, solve_linear(model, down), down)) /
                     (2 * kStep);
  }
  return 0.5 * (hessian + hessian.transpose());
}

}  // namespace

LinearSolution solve_linear(const LinearModel& model, const std::vector<double>& sigmas) {
  const Eigen::Index d = model.own, s = model.shared;
  std::vector<Eigen::MatrixXd> joint(static_cast<std::size_t>(model.groups),
                                     Eigen::MatrixXd::Zero(d + s + 1, d + s + 1));
  std::vector<double> inverse_variance(sigmas.size());
  for (std::size_t c = 0; c < sigmas.size(); ++c) inverse_variance[c] = 1 / (sigmas[c] * sigmas[c]);
  for (const GramBlock& block : model.blocks)
    joint[static_cast<std::size_t>(block.group)] +=
        inverse_variance[static_cast<std::size_t>(block.component)] * block.gram;

  // Eliminate each group: H_dd^-1 [H_ds b_d], and what is left on [s 1].
  LinearSolution solution;
  Eigen::MatrixXd reduced = Eigen::MatrixXd::Zero(s + 1, s + 1);
  if (model.prior.size() > 0) reduced = model.prior;
  std::vector<Eigen::MatrixXd> eliminated(joint.size()), inverse_own(joint.size());
  for (std::size_t g = 0; g < joint.size(); ++g) {
    reduced += joint[g].bottomRightCorner(s + 1, s + 1);
    if (d == 0) continue;
    const Eigen::LDLT<Eigen::MatrixXd> ldlt(joint[g].topLeftCorner(d, d));
    inverse_own[g] = ldlt.solve(Eigen::MatrixXd::Identity(d, d));
    eliminated[g] = ldlt.solve(joint[g].topRightCorner(d, s + 1));
    reduced -= joint[g].bottomLeftCorner(s + 1, d) * eliminated[g];
    solution.deviance += log_determinant(ldlt);
  }
  solution.information = reduced.topLeftCorner(s, s);
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(solution.information);
  solution.shared = -ldlt.solve(reduced.topRightCorner(s, 1));
  const Eigen::MatrixXd covariance = ldlt.solve(Eigen::MatrixXd::Identity(s, s));
  solution.deviance += log_determinant(ldlt);
  solution.own.resize(joint.size());
  // Joint covariance of [d s] of each group: its trace with a Gram matrix is what those residuals pay for.
  std::vector<Eigen::MatrixXd> joint_covariance(joint.size(), covariance);
  for (std::size_t g = 0; g < joint.size(); ++g) {
    if (d == 0) continue;
    solution.own[g] = -(eliminated[g].leftCols(s) * solution.shared + eliminated[g].col(s));
    const Eigen::MatrixXd cross = -eliminated[g].leftCols(s) * covariance;
    Eigen::MatrixXd& full = joint_covariance[g];
    full.resize(d + s, d + s);
    full << inverse_own[g] - cross * eliminated[g].leftCols(s).transpose(), cross, cross.transpose(),
        covariance;
  }
  solution.squares = solution.redundancy = Eigen::VectorXd::Zero(model.components);
  for (const GramBlock& block : model.blocks) {
    const auto g = static_cast<std::size_t>(block.group);
    Eigen::VectorXd x(d + s + 1);
    if (d > 0) x.head(d) = solution.own[g];
    x.segment(d, s) = solution.shared;
    x[d + s] = 1;
    const double weight = inverse_variance[static_cast<std::size_t>(block.component)];
    solution.squares[block.component] += x.dot(block.gram * x);
    solution.redundancy[block.component] +=
        block.count - weight * joint_covariance[g].cwiseProduct(block.gram.topLeftCorner(d + s, d + s)).sum();
    solution.deviance -= block.count * std::log(weight);
  }
  for (Eigen::Index c = 0; c < solution.squares.size(); ++c)
    solution.deviance += inverse_variance[static_cast<std::size_t>(c)] * solution.squares[c];
  for (std::size_t c = 0; c < sigmas.size(); ++c)
    solution.deviance += std::pow(surprise(model.noise, c, sigmas[c]), 2);
  for (const NoiseRatio& ratio : model.noise.ratios)
    solution.deviance += std::pow(surprise(ratio, sigmas), 2);
  if (model.prior.size() > 0) {
    const Eigen::VectorXd x = solution.shared.homogeneous();
    solution.deviance += x.dot(model.prior * x);
  }
  return solution;
}

VarianceComponents estimate_variance_components(const LinearModel& model, const std::vector<double>& start,
                                                const std::vector<double>& floor) {
  VarianceComponents result;
  result.sigmas = scaled(start, Eigen::VectorXd::Zero(model.components), floor);
  const std::vector<bool> absent = untold(model);
  LinearSolution here = solve_linear(model, result.sigmas);
  Eigen::MatrixXd hessian = Eigen::MatrixXd::Identity(model.components, model.components);
  for (; result.iterations < 50; ++result.iterations) {
    Eigen::VectorXd gradient = gradient_of(model, here, result.sigmas);
    hessian = hessian_of(model, result.sigmas);
    for (Eigen::Index c = 0; c < gradient.size(); ++c) {
      const auto i = static_cast<std::size_t>(c);
      const bool at_floor = result.sigmas[i] <= floor[i] && gradient[c] > 0;
      if (!absent[i] && !at_floor) continue;
      gradient[c] = 0;
      hessian.row(c).setZero();
      hessian.col(c).setZero();
      hessian(c, c) = absent[i] ? 1e12 : 1;
    }
    // Newton's step, downhill whatever the curvature, at most a factor e^2 a component.
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(hessian);
    const Eigen::VectorXd curvature = eigen.eigenvalues().cwiseAbs().cwiseMax(0.05);
    Eigen::VectorXd step =
        -eigen.eigenvectors() * (eigen.eigenvectors().transpose() * gradient).cwiseQuotient(curvature);
    step *= std::min(1.0, 2 / std::max(step.cwiseAbs().maxCoeff(), 1e-300));
    if (step.cwiseAbs().maxCoeff() < 1e-6) {
      result.converged = true;
      break;
    }
    bool improved = false;
    for (int halving = 0; halving < 20 && !improved; ++halving, step *= 0.5) {
      const std::vector<double> trial = scaled(result.sigmas, step, floor);
      LinearSolution there = solve_linear(model, trial);
      if (!(there.deviance <= here.deviance)) continue;
      result.gain += here.deviance - there.deviance;
      result.sigmas = trial;
      here = std::move(there);
      improved = true;
    }
    if (!improved) {
      result.converged = true;
      break;
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(hessian);
  // The deviance is twice the negative log likelihood.
  const Eigen::VectorXd variances = 2 * eigen.eigenvalues().cwiseAbs().cwiseMax(0.05).cwiseInverse();
  result.log_covariance = eigen.eigenvectors() * variances.asDiagonal() * eigen.eigenvectors().transpose();
  return result;
}

Eigen::MatrixXd adjusted_covariance(const LinearModel& model, const VarianceComponents& components) {
  // A component that cannot be told from zero has no scale in log sigma: that it is known to half a unit (one
  // standard deviation) is enough.
  constexpr double kWidest = 0.5;
  // Gauss and Hermite's, for a standard normal.
  constexpr std::array<double, 4> kNodes = {0, 1.154405395, 2.366759411, 3.750439718};
  constexpr std::array<double, 4> kWeights = {0.457142857, 0.240123179, 0.030757124, 0.000548269};
  const auto inverse = [](const Eigen::MatrixXd& information) -> Eigen::MatrixXd {
    return information.ldlt().solve(Eigen::MatrixXd::Identity(information.rows(), information.cols()));
  };
  const LinearSolution centre = solve_linear(model, components.sigmas);
  const Eigen::MatrixXd stated = inverse(centre.information);
  Eigen::MatrixXd covariance = stated;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(components.log_covariance);
  const std::vector<double> no_floor(components.sigmas.size(), 0);
  for (Eigen::Index k = 0; k < eigen.eigenvalues().size(); ++k) {
    const double deviation = std::sqrt(std::max(0.0, eigen.eigenvalues()[k]));
    if (deviation == 0) continue;
    const double width = std::min(kWidest, deviation);
    double weights = 0;
    Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(model.shared, model.shared), squares = mean;
    Eigen::VectorXd shift = Eigen::VectorXd::Zero(model.shared);
    const auto add = [&](double x, double weight) {
      const Eigen::VectorXd step = x * width * eigen.eigenvectors().col(k);
      const LinearSolution there = solve_linear(model, scaled(components.sigmas, step, no_floor));
      const Eigen::MatrixXd covariance_there = inverse(there.information);
      // The likelihood over the normal distribution that it is near its maximum: its longer tail is towards
      // larger errors. Towards smaller ones that of a component that is hardly told does not fall at all;
      // there it counts as normal.
      const double normal = std::pow(x * width / deviation, 2);
      const double ratio = std::exp(0.5 * (normal - there.deviance + centre.deviance));
      const bool smaller = stated.ldlt().solve(covariance_there).trace() < static_cast<double>(model.shared);
      weight *= smaller ? std::min(1.0, ratio) : ratio;
      const Eigen::VectorXd moved = there.shared - centre.shared;
      weights += weight;
      mean += weight * covariance_there;
      shift += weight * moved;
      squares += weight * moved * moved.transpose();
    };
    add(kNodes[0], kWeights[0]);
    for (const std::size_t i : {1U, 2U, 3U})
      for (const double side : {-1.0, 1.0}) add(side * kNodes[i], kWeights[i]);
    shift /= weights;
    covariance += mean / weights - stated + squares / weights - shift * shift.transpose();
  }
  return covariance;
}

double tail_growth(double dof) {
  // Of F(6, dof): its regularised incomplete beta function is a polynomial.
  const auto beyond = [dof](double f) {
    const double x = dof / (dof + 6 * f), a = 0.5 * dof, y = 1 - x;
    return std::pow(x, a) * (1 + a * y * (1 + 0.5 * (a + 1) * y));
  };
  double low = 1, high = 1e6;
  while (high - low > 1e-6 * low) {
    const double middle = std::sqrt(low * high);
    (beyond(middle) > 0.01 ? low : high) = middle;
  }
  return 6 * low / data::chi_square_99_of_6 * (dof - 2) / dof;
}

}  // namespace flash::calib
