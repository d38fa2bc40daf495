#pragma once
#include <Eigen/Core>
#include <vector>

#include "sysid/emulate/parameter_grid.h"
#include "sysid/emulate/tensor_spline.h"

namespace flash::sysid {

/// Stiffnesses, weights, friction and damping count by their logarithm wherever they are above zero, however
/// their values were listed.
std::vector<Axis> in_own_coordinates(std::vector<Axis> axes);

/// Coordinate of a value on its axis, the logarithm of a logarithmic one, and back.
double coordinate_of(const Axis& axis, double value);
double value_of(const Axis& axis, double coordinate);

/// What a likelihood says over a grid of parameter values, flat before in the coordinates of the axes.
struct Posterior {
  std::vector<Axis> axes;    ///< of the grid
  TensorSpline deviance;     ///< -2 log likelihood over coordinates, above that of the likeliest point
  Eigen::VectorXd estimate;  ///< coordinates where it is least
  double least = 0;          ///< deviance there
  Eigen::MatrixXd samples;   ///< coordinates, a draw a row

  std::vector<double> values() const;                  ///< of the estimate
  double quantile(std::size_t k, double share) const;  ///< coordinate of axis k
  double end(std::size_t k, bool high) const;  ///< least deviance at an end of axis k, over that of all
};

/// `deviance`: of each point of the grid of `axes`, the last axis fastest; a point without one is infinite.
Posterior explore_posterior(const std::vector<Axis>& axes, const Eigen::VectorXd& deviance,
                            unsigned seed = 1);

/// What a likelihood says that is known at the points of the grid alone and changes abruptly between them:
/// each point speaks for all up to its neighbours. The estimate is the likeliest point.
Posterior explore_at_points(const std::vector<Axis>& axes, const Eigen::VectorXd& deviance,
                            unsigned seed = 1);

}  // namespace flash::sysid
