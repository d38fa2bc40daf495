#pragma once
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>
#include <vector>

namespace flash::calib {

/// Brightness of a pixel, and where it lies [rectified px].
struct Sample {
  Eigen::Vector2d place;
  double value;
};

template <int N>
struct ShapeFit {
  Eigen::Matrix<double, N, 1> parameters;
  double rms = 0;          ///< of the brightness left over
  bool converged = false;  ///< the last step was below a thousandth of `scales`
};

/// Least squares of `model(parameters, place)` on the brightness of pixels, by Levenberg and Marquardt with
/// differences as derivatives. scales: a small change of each parameter; steps of a hundred times that are
/// cut.
template <int N, class Model>
ShapeFit<N> fit_shape(const Model& model, const Eigen::Matrix<double, N, 1>& start,
                      const Eigen::Matrix<double, N, 1>& scales, const std::vector<Sample>& samples,
                      int iterations = 30) {
  using Vector = Eigen::Matrix<double, N, 1>;
  using Matrix = Eigen::Matrix<double, N, N>;
  ShapeFit<N> fit;
  fit.parameters = start;
  if (samples.size() < 2 * N) return fit;
  const auto cost_of = [&](const Vector& x) {
    double sum = 0;
    for (const Sample& sample : samples) {
      const double residual = sample.value - model(x, sample.place);
      sum += residual * residual;
    }
    return sum;
  };
  double cost = cost_of(start), damping = 1e-3;
  for (int iteration = 0; iteration < iterations && !fit.converged; ++iteration) {
    Matrix normal = Matrix::Zero();
    Vector gradient = Vector::Zero();
    for (const Sample& sample : samples) {
      const double value = model(fit.parameters, sample.place);
      Vector row;
      for (int k = 0; k < N; ++k) {
        const double step = 1e-3 * scales[k];
        Vector moved = fit.parameters;
        moved[k] += step;
        row[k] = (model(moved, sample.place) - value) / step;
      }
      normal.template selfadjointView<Eigen::Lower>().rankUpdate(row);
      gradient += row * (sample.value - value);
    }
    normal = normal.template selfadjointView<Eigen::Lower>();
    for (; damping < 1e6; damping *= 10) {
      Matrix damped = normal;
      for (int k = 0; k < N; ++k) damped(k, k) += damping * normal(k, k) + 1e-12 / (scales[k] * scales[k]);
      Vector step = damped.ldlt().solve(gradient);
      if (!step.allFinite()) return fit;
      const double longest = step.cwiseQuotient(scales).cwiseAbs().maxCoeff();
      if (longest > 100) step *= 100 / longest;
      const double moved_cost = cost_of(fit.parameters + step);
      // At the minimum rounding decides which of two equal costs is less.
      if (moved_cost <= cost || longest < 1e-3) {
        fit.converged = longest < 1e-3;
        if (moved_cost <= cost) {
          fit.parameters += step;
          cost = moved_cost;
        }
        damping = std::max(1e-9, damping / 10);
        break;
      }
    }
    if (damping >= 1e6) break;
  }
  fit.rms = std::sqrt(cost / static_cast<double>(samples.size()));
  return fit;
}

}  // namespace flash::calib
