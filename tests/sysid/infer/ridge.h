#pragma once
#include <Eigen/Core>
#include <cmath>
#include <random>

namespace flash::sysid {

/// A ridge with exact answers: x = centre + z, where the coordinates of z are Gaussian of deviation `sd` and
/// correlate alike with each other. Where it is bent, all but the first have bend (z_0^2 / sd - sd) more.
/// The map from z has Jacobian 1.
struct Ridge {
  Eigen::VectorXd centre;
  double sd = 0.03;
  double correlation = 0.9;
  double bend = 0;

  Eigen::Index dimensions() const { return centre.size(); }

  double bend_at(double z_0) const { return bend * (z_0 * z_0 / sd - sd); }

  /// Up to a constant.
  double log_density(const Eigen::VectorXd& x) const {
    Eigen::VectorXd z = x - centre;
    z.tail(z.size() - 1).array() -= bend_at(z[0]);
    const auto d = static_cast<double>(z.size());
    const double common = correlation / (1 + (d - 1) * correlation);  // Sherman and Morrison
    return -0.5 * (z.squaredNorm() - common * z.sum() * z.sum()) / ((1 - correlation) * sd * sd);
  }

  Eigen::VectorXd draw(std::mt19937_64& random) const {
    std::normal_distribution<double> normal;
    const double common = normal(random);
    Eigen::VectorXd z(dimensions());
    for (double& each : z)
      each = sd * (std::sqrt(correlation) * common + std::sqrt(1 - correlation) * normal(random));
    z.tail(z.size() - 1).array() += bend_at(z[0]);
    return centre + z;
  }

  double deviation(Eigen::Index k) const {
    return sd * std::sqrt(1 + (k == 0 ? 0 : 2 * bend * bend));  // the variance of z^2 is 2
  }

  /// Share of coordinate k below x: quadrature over z_0, given which z_k is Gaussian.
  double share_below(Eigen::Index k, double x) const {
    const double z = (x - centre[k]) / sd;
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

}  // namespace flash::sysid
