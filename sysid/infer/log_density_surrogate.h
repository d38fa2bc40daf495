#pragma once
#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "sysid/infer/bent_student.h"

namespace flash::sysid {

/// Log densities at points, a row each.
struct AskedPoints {
  Eigen::MatrixXd points;
  Eigen::VectorXd log_densities;  ///< -infinity where the density is 0

  Eigen::Index size() const { return points.rows(); }
  void add(const Eigen::MatrixXd& more, const Eigen::VectorXd& logs);
};

/// A Gaussian process for a log density (Rasmussen and Williams 2006, 2.7), which is known at some points: a
/// quadratic polynomial of white coordinates y by generalized least squares, and a squared exponential
///
///     k(x, y) = s^2 exp(-|x - y|^2 / (2 l^2)).
///
/// s, l and the noise are those of the largest marginal likelihood. White coordinates are those of a
/// BentStudent, so that a ridge along a parabola is a Gaussian. A log density far below the largest need be
/// known by its size alone: beyond `kTold`, or beyond as many points as a polynomial needs, its deviation is
/// 0.15 of what it falls beyond that. Of many points the likeliest and the last count. It falls beyond ten
/// standard deviations.
class LogDensitySurrogate {
 public:
  static constexpr double kTold = 12;  ///< Below the largest: 4.9 sd of Gaussians. Work: draws are tried.

  /// At least as many points as a quadratic polynomial has coefficients, some of a density above 0.
  LogDensitySurrogate(const AskedPoints& all, BentStudent coordinates);

  /// At points, a row each.
  Eigen::VectorXd operator()(const Eigen::MatrixXd& points) const;

 private:
  struct Kernel {
    double size, reach, noise;  ///< s, l, standard deviation
  };
  struct Fitted {
    double log_marginal;
    Eigen::VectorXd coefficients, weights;  ///< of the polynomial, and of the kernel at each point
  };
  Fitted fitted(const Kernel& kernel) const;

  BentStudent coordinates_;
  Eigen::MatrixXd white_, squares_, basis_;  ///< of the points; squared distances between them
  Eigen::VectorXd values_, far_;             ///< below the largest; variances of what is far below it
  double highest_ = 0;
  Kernel kernel_{};
  Fitted best_{};
};

/// Of a quadratic polynomial of so many coordinates.
Eigen::Index quadratic_coefficients(Eigen::Index dimensions);

}  // namespace flash::sysid
