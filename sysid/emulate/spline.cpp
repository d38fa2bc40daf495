#include "sysid/emulate/spline.h"

#include <Eigen/LU>
#include <algorithm>

namespace flash::sysid {
namespace {

Eigen::MatrixXd second_derivatives(const Eigen::VectorXd& x) {
  const Eigen::Index n = x.size();
  if (n < 3) return Eigen::MatrixXd::Zero(n, n);
  Eigen::MatrixXd left = Eigen::MatrixXd::Zero(n, n), right = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 1; i + 1 < n; ++i) {
    const double below = x[i] - x[i - 1], above = x[i + 1] - x[i];
    left(i, i - 1) = below / 6;
    left(i, i) = (below + above) / 3;
    left(i, i + 1) = above / 6;
    right(i, i - 1) = 1 / below;
    right(i, i) = -1 / below - 1 / above;
    right(i, i + 1) = 1 / above;
  }
  if (n == 3) {
    left(0, 0) = left(2, 2) = 1;
    left(0, 1) = left(2, 1) = -1;
  } else {
    const auto no_knot = [&](Eigen::Index row, Eigen::Index i) {  // third derivative continuous at knot i
      const double below = x[i] - x[i - 1], above = x[i + 1] - x[i];
      left(row, i - 1) = above;
      left(row, i) = -(below + above);
      left(row, i + 1) = below;
    };
    no_knot(0, 1);
    no_knot(n - 1, n - 2);
  }
  return left.partialPivLu().solve(right);
}

}  // namespace

Spline::Spline(Eigen::VectorXd knots) : knots_(std::move(knots)), second_(second_derivatives(knots_)) {}

Spline::Local Spline::local(double t, int derivative) const {
  const Eigen::Index n = knots_.size();
  if (n == 1) return {{0, 0}, {derivative == 0 ? 1.0 : 0.0, 0}, {0, 0}};
  const Eigen::Index i = std::clamp<Eigen::Index>(
      std::upper_bound(knots_.data(), knots_.data() + n, t) - knots_.data() - 1, 0, n - 2);
  const double h = knots_[i + 1] - knots_[i], b = (t - knots_[i]) / h, a = 1 - b;
  if (derivative == 0)
    return {{i, i + 1}, {a, b}, {h * h / 6 * (a * a * a - a), h * h / 6 * (b * b * b - b)}};
  if (derivative == 1)
    return {{i, i + 1}, {-1 / h, 1 / h}, {h / 6 * (1 - 3 * a * a), h / 6 * (3 * b * b - 1)}};
  return {{i, i + 1}, {0, 0}, {a, b}};
}

Eigen::RowVectorXd Spline::weights(double t, int derivative) const {
  const Local local = this->local(t, derivative);
  Eigen::RowVectorXd weights = Eigen::RowVectorXd::Zero(knots_.size());
  for (const std::size_t side : {0, 1}) {
    weights[local.knots[side]] += local.values[side];
    weights += local.curvatures[side] * second_.row(local.knots[side]);
  }
  return weights;
}

}  // namespace flash::sysid
