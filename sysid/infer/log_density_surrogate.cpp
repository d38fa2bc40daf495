#include "sysid/infer/log_density_surrogate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

namespace flash::sysid {
namespace {

/// 1, coordinates, and their products, a row a point.
Eigen::MatrixXd quadratic_basis(const Eigen::MatrixXd& x) {
  const Eigen::Index d = x.cols();
  Eigen::MatrixXd basis(x.rows(), quadratic_coefficients(d));
  basis.col(0).setOnes();
  basis.middleCols(1, d) = x;
  Eigen::Index column = 1 + d;
  for (Eigen::Index i = 0; i < d; ++i)
    for (Eigen::Index j = 0; j <= i; ++j) basis.col(column++) = x.col(i).cwiseProduct(x.col(j));
  return basis;
}

Eigen::MatrixXd squared_distances(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::MatrixXd squares = -2 * a * b.transpose();
  squares.colwise() += a.rowwise().squaredNorm();
  squares.rowwise() += b.rowwise().squaredNorm().transpose();
  return squares.cwiseMax(0);
}

/// The likeliest points, and the last ones, which say where a surrogate was wrong. Time grows by the cube of
/// their number.
AskedPoints likeliest(const AskedPoints& all) {
  // Points that a surrogate is fitted to, at least, and a coefficient. Work: time grows by their cube.
  constexpr Eigen::Index kMost = 150, kPerCoefficient = 10;
  const Eigen::Index count =
      std::min(all.size(), std::max(kMost, kPerCoefficient * quadratic_coefficients(all.points.cols())));
  std::vector<Eigen::Index> order(static_cast<std::size_t>(all.size()));
  std::iota(order.rbegin(), order.rend(), 0);  // the last first
  std::stable_sort(order.begin() + count / 2, order.end(), [&](Eigen::Index a, Eigen::Index b) {
    return all.log_densities[a] > all.log_densities[b];
  });
  order.resize(static_cast<std::size_t>(count));
  return {all.points(order, Eigen::all), all.log_densities(order)};
}

}  // namespace

Eigen::Index quadratic_coefficients(Eigen::Index dimensions) {
  return (dimensions + 1) * (dimensions + 2) / 2;
}

void AskedPoints::add(const Eigen::MatrixXd& more, const Eigen::VectorXd& logs) {
  const Eigen::Index after = size() + more.rows();
  points.conservativeResize(after, more.cols());
  points.bottomRows(more.rows()) = more;
  log_densities.conservativeResize(after);
  log_densities.tail(more.rows()) = logs;
}

LogDensitySurrogate::Fitted LogDensitySurrogate::fitted(const Kernel& kernel) const {
  // Precision of a coefficient before, over what the points tell. Work: rounding.
  constexpr double kWide = 1e-10;
  Eigen::MatrixXd covariance =
      kernel.size * kernel.size * (-squares_.array() / (2 * kernel.reach * kernel.reach)).exp().matrix();
  covariance.diagonal().array() += kernel.noise * kernel.noise + far_.array();
  const Eigen::LLT<Eigen::MatrixXd> llt(covariance);
  const Eigen::MatrixXd basis = llt.matrixL().solve(basis_);
  const Eigen::VectorXd values = llt.matrixL().solve(values_);
  Eigen::MatrixXd normal = basis.transpose() * basis;
  normal.diagonal().array() += kWide * (1 + normal.diagonal().maxCoeff());
  const Eigen::LLT<Eigen::MatrixXd> of_basis(normal);
  Fitted fitted;
  fitted.coefficients = of_basis.solve(basis.transpose() * values);
  const Eigen::VectorXd left = values - basis * fitted.coefficients;
  fitted.weights = llt.matrixU().solve(left);
  const auto log_determinant = [](const Eigen::LLT<Eigen::MatrixXd>& of) {
    return 2 * of.matrixLLT().diagonal().array().log().sum();
  };
  fitted.log_marginal = -0.5 * (left.squaredNorm() + log_determinant(llt) + log_determinant(of_basis));
  return fitted;
}

LogDensitySurrogate::LogDensitySurrogate(const AskedPoints& all, BentStudent coordinates)
    : coordinates_(std::move(coordinates)) {
  // Of what a log density falls beyond what is told: how well it need be known. Work: a surrogate, whose
  // draws are tried.
  constexpr double kRough = 0.15;
  constexpr int kNear = 3;  // Points a coefficient that are known in any case. Work: likewise.
  const AskedPoints asked = likeliest(all);
  white_ = coordinates_.white(asked.points);
  squares_ = squared_distances(white_, white_);
  basis_ = quadratic_basis(white_);
  highest_ = asked.log_densities.maxCoeff();
  double lowest = 0;
  for (const double log : asked.log_densities)
    if (std::isfinite(log)) lowest = std::min(lowest, log - highest_);
  values_ = asked.log_densities.unaryExpr(
      [&](double log) { return std::isfinite(log) ? log - highest_ : 2 * lowest - kTold; });
  Eigen::VectorXd falls = -values_;
  const Eigen::Index near = std::min(kNear * basis_.cols(), falls.size() - 1);
  std::nth_element(falls.data(), falls.data() + near, falls.data() + falls.size());
  far_ = (kRough * (-values_.array() - std::max(kTold, falls[near])).max(0)).square();
  // Of size, reach and noise of the kernel, by pattern search over the logarithms. Work: likewise.
  constexpr std::array<std::array<double, 2>, 3> kBounds = {{{1e-2, 1e4}, {0.3, 30}, {1e-3, 3}}};
  constexpr double kLast = 1.3;  // Factor with which the search of these ends. Work: likewise.
  std::array<double, 3> at = {3, 3, 0.03};
  const auto of = [](const std::array<double, 3>& x) { return Kernel{x[0], x[1], x[2]}; };
  kernel_ = of(at);
  best_ = fitted(kernel_);
  for (double factor = 4; factor > kLast;) {
    bool better = false;
    for (std::size_t k = 0; k < at.size(); ++k)
      for (const double by : {1 / factor, factor}) {
        std::array<double, 3> next = at;
        next[k] = std::clamp(at[k] * by, kBounds[k][0], kBounds[k][1]);
        if (next[k] == at[k]) continue;
        Fitted there = fitted(of(next));
        if (!(there.log_marginal > best_.log_marginal)) continue;
        at = next;
        best_ = std::move(there);
        better = true;
      }
    if (!better) factor = std::sqrt(factor);
  }
  kernel_ = of(at);
}

Eigen::VectorXd LogDensitySurrogate::operator()(const Eigen::MatrixXd& points) const {
  // Of white coordinates: a polynomial may rise again far from its points. Work: likewise.
  constexpr double kSupport = 10;
  const Eigen::MatrixXd white = coordinates_.white(points);
  const Eigen::ArrayXXd exponents =
      squared_distances(white, white_).array() / (-2 * kernel_.reach * kernel_.reach);
  const Eigen::ArrayXd beyond = (white.rowwise().norm().array() - kSupport).max(0);
  return (quadratic_basis(white) * best_.coefficients +
          kernel_.size * kernel_.size * (exponents.exp().matrix() * best_.weights))
             .array() +
         highest_ - 5 * beyond.square();
}

}  // namespace flash::sysid
