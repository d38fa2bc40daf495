#include "sysid/infer/residual_likelihood.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "data/numbers/median.h"
#include "sysid/infer/agreed_numbers.h"

namespace flash::sysid {
namespace {

/// Over the noise: where Huber's function turns to a distance. Theory: 95 % of the efficiency of least
/// squares under normal noise (Huber 1964).
constexpr double kEfficient = 1.345;
constexpr int kRounds = 30, kFits = 20;  // Of the spread, and of a fit. Work: caps.
/// Of the spread, and of the deviance. Work: where rounds end.
constexpr double kSame = 1e-3, kSameFit = 1e-6;

/// Columns that make the information 1; directions of none are left out.
Eigen::MatrixXd inverse_root(const Eigen::MatrixXd& information) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(information);
  const Eigen::VectorXd& values = eigen.eigenvalues();
  std::vector<Eigen::Index> told;
  for (Eigen::Index i = 0; i < values.size(); ++i)
    if (values[i] > least_information * values[values.size() - 1]) told.push_back(i);
  return eigen.eigenvectors()(Eigen::all, told) * values(told).cwiseSqrt().cwiseInverse().asDiagonal();
}

/// The solution of which the first `bounded` coordinates end at -1 and 1.
Eigen::VectorXd solve_within(const Eigen::MatrixXd& normal, const Eigen::VectorXd& right,
                             Eigen::Index bounded) {
  Eigen::VectorXd solution = normal.llt().solve(right);
  std::vector<Eigen::Index> held, left;
  for (Eigen::Index i = 0; i < solution.size(); ++i)
    (i < bounded && std::abs(solution[i]) > 1 ? held : left).push_back(i);
  while (!held.empty() && !left.empty()) {
    solution(held) = solution(held).cwiseMax(-1).cwiseMin(1).eval();
    solution(left) = normal(left, left).llt().solve(right(left) - normal(left, held) * solution(held)).eval();
    const auto beyond = std::find_if(
        left.begin(), left.end(), [&](Eigen::Index i) { return i < bounded && std::abs(solution[i]) > 1; });
    if (beyond == left.end()) break;
    held.push_back(*beyond);
    left.erase(beyond);
  }
  solution.head(bounded) = solution.head(bounded).cwiseMax(-1).cwiseMin(1).eval();
  return solution;
}

}  // namespace

ResidualLikelihood::Fit ResidualLikelihood::fit(const Eigen::VectorXd& residuals,
                                                const Eigen::MatrixXd& known) const {
  Eigen::MatrixXd columns = known_;
  if (known.size() > 0) columns.rightCols(known.cols()) = known;
  const double precision = 1 / (spread_ * spread_);
  const Eigen::MatrixXd by_row = columns.transpose();
  // The normal equations as if every row counted by its square.
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(columns.cols(), columns.cols());
  all.selfadjointView<Eigen::Lower>().rankUpdate(by_row * weights_.cwiseSqrt().asDiagonal(), precision);
  const Eigen::VectorXd all_right = precision * (by_row * weights_.cwiseProduct(residuals));
  all.diagonal() += priors_;
  Fit fit{0, {}, {}, residuals, weights_};
  Eigen::VectorXd errors = Eigen::VectorXd::Zero(columns.cols());
  double before = INFINITY;
  for (int round = 0; round < kFits; ++round) {
    // Where rho is a distance, its weight is that of a square of the same slope: what such rows, few, count
    // less is taken off.
    Eigen::MatrixXd normal = all;
    Eigen::VectorXd right = all_right;
    fit.weights = weights_;
    for (Eigen::Index i = 0; i < fit.left.size(); ++i) {
      const double size = std::abs(fit.left[i]);
      if (size <= limit_) continue;
      fit.weights[i] *= limit_ / size;
      const double less = precision * (weights_[i] - fit.weights[i]);
      right -= less * residuals[i] * by_row.col(i);
      for (Eigen::Index c = 0; c < by_row.rows(); ++c)
        normal.col(c).tail(by_row.rows() - c) -= less * by_row(c, i) * by_row.col(i).tail(by_row.rows() - c);
    }
    errors = solve_within(normal.selfadjointView<Eigen::Lower>(), right, free_);
    fit.left = residuals - columns * errors;
    fit.free = errors.head(free_);
    fit.known = errors.tail(errors.size() - free_);
    fit.deviance = deviance_of(fit.left, fit.free, fit.known);
    if (before - fit.deviance < kSameFit * (1 + fit.deviance)) break;
    before = fit.deviance;
  }
  return fit;
}

double ResidualLikelihood::deviance_of(const Eigen::VectorXd& left, const Eigen::VectorXd& free,
                                       const Eigen::VectorXd& known) const {
  double sum = 0;
  for (Eigen::Index i = 0; i < left.size(); ++i) {
    const double size = std::abs(left[i]);
    sum += weights_[i] * (size <= limit_ ? size * size : limit_ * (2 * size - limit_));
  }
  return sum / (spread_ * spread_) + free.cwiseAbs2().dot(priors_.head(free_)) +
         known.cwiseAbs2().dot(priors_.tail(known.size()));
}

Eigen::MatrixXd ResidualLikelihood::weigh(const Eigen::MatrixXd& columns,
                                          const Eigen::VectorXd& weights) const {
  const Eigen::MatrixXd weighed = weights.asDiagonal() * columns, known = weights.asDiagonal() * known_;
  Eigen::MatrixXd normal = known_.transpose() * known;
  normal.diagonal() += spread_ * spread_ * priors_;
  return (weighed - known * normal.llt().solve(known.transpose() * columns)) / (spread_ * spread_);
}

Eigen::VectorXd ResidualLikelihood::error_variances() const {
  Eigen::MatrixXd all(known_.rows(), known_.cols() + rates_.cols());
  all << known_, rates_;
  Eigen::MatrixXd normal = all.transpose() * weights_.asDiagonal() * all / (spread_ * spread_);
  normal.diagonal().head(priors_.size()) += priors_;
  normal.diagonal().tail(rates_.cols()).array() += free_precision;
  return normal.llt().solve(Eigen::MatrixXd::Identity(all.cols(), all.cols())).diagonal().head(known_.cols());
}

Eigen::VectorXd ResidualLikelihood::known_spread() const {
  return error_variances().tail(known_.cols() - free_).cwiseSqrt();
}

Eigen::VectorXd ResidualLikelihood::free_spread() const {
  constexpr double kEven = 1.0 / 3;  // Variance of what is even between -1 and 1. Theory: a third.
  return error_variances().head(free_).cwiseMin(kEven).cwiseSqrt();
}

Eigen::VectorXd ResidualLikelihood::curvature_of(const Eigen::VectorXd& left) const {
  const Eigen::VectorXd distances = left.cwiseAbs();
  std::vector<double> sizes(distances.begin(), distances.end());
  const double window = std::max(limit_, data::median(std::move(sizes)));
  return left.unaryExpr([&](double y) { return std::abs(y) <= window ? limit_ / window : 0.0; });
}

ResidualLikelihood::ResidualLikelihood(ObservedRows rows, const Eigen::VectorXd& residuals,
                                       std::optional<double> repeatability, std::optional<double> limit,
                                       int threads)
    : weights_(rows.weights), free_(rows.free.cols()), known_(residuals.size(), free_ + rows.known.cols()) {
  if (free_ > 0) known_.leftCols(free_) = rows.free;
  if (rows.known.cols() > 0) known_.rightCols(rows.known.cols()) = rows.known;
  priors_ = Eigen::VectorXd::Ones(known_.cols());
  priors_.head(free_).setConstant(free_precision);
  const DiscrepancyModel model(std::move(rows), residuals, repeatability, threads);
  misfit_ = model.misfit();
  misfit_.worth = misfit_.keyframes;
  limit_ = limit.value_or(kEfficient * misfit_.noise);
  spread_ = misfit_.noise;
  const Eigen::MatrixXd& rates = model.rows().rates;
  rates_ = rates;
  if (rates.cols() == 0) return;
  for (int round = 0; round < kRounds; ++round) {
    const Fit here = fit(residuals);
    const Eigen::VectorXd bent = curvature_of(here.left).cwiseProduct(weights_);
    const Eigen::MatrixXd root = inverse_root(rates.transpose() * weigh(rates, bent));
    if (root.cols() == 0) {  // nothing moves with the parameters
      spread_ = std::max(model.residual_size(), misfit_.noise);
      return;
    }
    const Eigen::MatrixXd slopes = weigh(rates, here.weights) * root;
    const Eigen::MatrixXd covariance = model.covariance_of(slopes);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance);
    const Eigen::Index last = covariance.cols() - 1;
    const Eigen::VectorXd worst = eigen.eigenvectors().col(last);
    misfit_.worth = misfit_.keyframes * std::min(1.0, worst.dot(model.covariance_of(slopes, true) * worst) /
                                                          eigen.eigenvalues()[last]);
    const double next = std::max(spread_ * std::sqrt(eigen.eigenvalues()[last]), misfit_.noise);
    if (!(std::abs(next - spread_) > kSame * spread_)) break;
    spread_ = next;
  }
}

}  // namespace flash::sysid
