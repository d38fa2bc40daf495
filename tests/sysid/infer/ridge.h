#pragma once
#include <Eigen/Core>
#include <cmath>
#include <random>

namespace flash::sysid {

/// A ridge with exact answers: x = centre + z, where the coordinates of z are Gaussian of deviation `sd` and
/// correlate alike with each other. Where it is bent, all but the first have bend (z_0^2 / sd - sd) more, of
/// Jacobian 1. Where it is stretched, z_k is sd (exp(a z_k / sd) - 1) / a, of a = stretch and -stretch by
/// turns, so that the ridge is a curve of no parabola. It is one or the other.
struct Ridge {
  Eigen::VectorXd centre;
  double sd = 0.03;
  double correlation = 0.9;
  double bend = 0, stretch = 0;

  Eigen::Index dimensions() const { return centre.size(); }

  double bend_at(double z_0) const { return bend * (z_0 * z_0 / sd - sd); }

  double stretch_of(Eigen::Index k) const { return k % 2 == 0 ? stretch : -stretch; }

  double stretched(Eigen::Index k, double z) const {
    const double a = stretch_of(k);
    return a == 0 ? z : sd * std::expm1(a * z / sd) / a;
  }

  /// The inverse; where there is none, an infinite one.
  double unstretched(Eigen::Index k, double from_centre) const {
    const double a = stretch_of(k), grown = a * from_centre / sd;
    if (a == 0) return from_centre;
    return grown > -1 ? sd * std::log1p(grown) / a : std::copysign(INFINITY, -a);
  }

  /// Up to a constant.
  double log_density(const Eigen::VectorXd& x) const {
    Eigen::VectorXd z(dimensions());
    double log_jacobian = 0;
    for (Eigen::Index k = 0; k < z.size(); ++k) {
      z[k] = unstretched(k, x[k] - centre[k]);
      log_jacobian += stretch_of(k) * z[k] / sd;
    }
    if (!z.allFinite()) return -INFINITY;
    z.tail(z.size() - 1).array() -= bend_at(z[0]);
    const auto d = static_cast<double>(z.size());
    const double common = correlation / (1 + (d - 1) * correlation);  // Sherman and Morrison
    return -log_jacobian -
           0.5 * (z.squaredNorm() - common * z.sum() * z.sum()) / ((1 - correlation) * sd * sd);
  }

  Eigen::VectorXd draw(std::mt19937_64& random) const {
    std::normal_distribution<double> normal;
    const double common = normal(random);
    Eigen::VectorXd z(dimensions());
    for (double& each : z)
      each = sd * (std::sqrt(correlation) * common + std::sqrt(1 - correlation) * normal(random));
    z.tail(z.size() - 1).array() += bend_at(z[0]);
    for (Eigen::Index k = 0; k < z.size(); ++k) z[k] = stretched(k, z[k]);
    return centre + z;
  }

  double deviation(Eigen::Index k) const {
    const double grown = std::exp(stretch * stretch);  // log-normal
    if (stretch != 0) return sd * std::sqrt(grown * (grown - 1)) / stretch;
    return sd * std::sqrt(1 + (k == 0 ? 0 : 2 * bend * bend));  // the variance of z^2 is 2
  }

  /// Share of coordinate k below x: quadrature over z_0, given which z_k is Gaussian.
  double share_below(Eigen::Index k, double x) const {
    const double z = unstretched(k, x - centre[k]) / sd;
    const auto below = [](double normal) { return 0.5 * std::erfc(-normal / std::sqrt(2.0)); };
    if (k == 0) return below(z);
    constexpr int kParts = 4000;  // the midpoint rule converges exponentially for Gaussians
    constexpr double kEnd = 8;
    double sum = 0;
    for (int i = 0; i < kParts; ++i) {
      const double z_0 = kEnd * (2 * (i + 0.5) / kParts - 1);
      const double mean = correlation * z_0 + bend * (z_0 * z_0 - 1);
      sum += std::exp(-0.5 * z_0 * z_0) * below((z - mean) / std::sqrt(1 - correlation * correlation));
    }
    return sum * 2 * kEnd / kParts / std::sqrt(2 * M_PI);
  }

  /// By bisection.
  double quantile(Eigen::Index k, double share) const {
    double low = centre[k] - 10 * sd, high = centre[k] + (10 + 100 * std::abs(bend)) * sd;
    for (int i = 0; i < 60; ++i) {
      const double middle = (low + high) / 2;
      (share_below(k, middle) < share ? low : high) = middle;
    }
    return low;
  }
};

/// A log density for samplers, which ask for many points together, a row each.
template <class Function>
auto each_of(const Function& log_density) {
  return [=](const Eigen::MatrixXd& points) {
    Eigen::VectorXd logs(points.rows());
    for (Eigen::Index i = 0; i < points.rows(); ++i) logs[i] = log_density(points.row(i).transpose());
    return logs;
  };
}

}  // namespace flash::sysid
