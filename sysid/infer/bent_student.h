#pragma once
#include <Eigen/Core>

#include "sysid/infer/random_numbers.h"

namespace flash::sysid {

/// A multivariate Student t that is bent to a parabola: x = mean + r + bend (along . r)^2, where r has mean 0
/// and scale root root^T. Since along . bend = 0, the map from r to x has Jacobian 1. Of bend 0 it is
/// straight.
struct BentStudent {
  static constexpr int kFreedom = 5;  ///< Degrees of freedom. Work: tails that bound the weights of draws.
  Eigen::VectorXd mean, along, bend;
  Eigen::MatrixXd root;  ///< lower triangular

  /// Coordinates r in units of root, in which it is a straight one about 0 of scale 1: of points, a row each.
  Eigen::MatrixXd white(const Eigen::MatrixXd& points) const;
  /// Of points, a row each.
  Eigen::ArrayXd densities(const Eigen::MatrixXd& points) const;
  Eigen::VectorXd draw(RandomNumbers& random) const;
};

/// The one that weighted points, a row each, look like. In white coordinates y, of mean 0 and covariance 1,
/// least squares of y on 1, t and t^2 with t = v . y have the coefficient (g - (g . v) v) / s of t^2, where
/// g = E[y t^2] and s = E[t^4] - 1 - (g . v)^2. The parabola lies along the v whose t^2 explains most of
/// the variance of y. Points whose parabola may be chance give a straight one. The scale is their
/// covariance about the parabola: the fewer points weigh, the more of it is `prior`, a covariance.
/// `weights` sum to 1.
BentStudent fitted_student(const Eigen::MatrixXd& points, const Eigen::VectorXd& weights,
                           const Eigen::MatrixXd& prior);

}  // namespace flash::sysid
