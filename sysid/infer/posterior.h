#pragma once
#include <Eigen/Core>
#include <vector>

#include "sysid/emulate/parameter_grid.h"

namespace flash::sysid {

/// Stiffnesses, weights, friction and damping count by their logarithm wherever they are above zero, however
/// their values were listed.
std::vector<Axis> in_own_coordinates(std::vector<Axis> axes);

/// Coordinate of a value on its axis, the logarithm of a logarithmic one, and back.
double coordinate_of(const Axis& axis, double value);
double value_of(const Axis& axis, double coordinate);

/// What a likelihood says over a grid of parameter values, flat before in the coordinates of the axes.
struct Posterior {
  std::vector<Axis> axes;      ///< of the grid
  Eigen::VectorXd estimate;    ///< coordinates of the likeliest
  Eigen::MatrixXd samples;     ///< coordinates, a draw a row
  Eigen::ArrayX2d ends;        ///< least deviance at the low and the high end of each axis, over that of all
  Eigen::ArrayX2d reach = {};  ///< coordinates that intervals hold at least; empty: none

  std::vector<double> values() const;                  ///< of the estimate
  double quantile(std::size_t k, double share) const;  ///< coordinate of axis k
};

/// `deviance`: of each point of the grid of `axes`, the last axis fastest; a point without one is infinite.
Posterior explore_posterior(const std::vector<Axis>& axes, const Eigen::VectorXd& deviance,
                            unsigned seed = 1);

/// What a likelihood says that is known at the points of the grid alone and changes abruptly between them:
/// each point speaks for all up to its neighbours. The estimate is the likeliest point.
Posterior explore_at_points(const std::vector<Axis>& axes, const Eigen::VectorXd& deviance,
                            unsigned seed = 1);

/// A mixture of two posteriors, over the axes and with the estimate of `other`, which has `share` of it.
Posterior mixture(const Posterior& posterior, Posterior other, double share);

/// What motions say that change abruptly between the values of a search: the likely ones speak for all up to
/// the values searched below and above them. Each draw becomes one between its neighbours, each parameter by
/// itself, and intervals reach to the neighbours of what was likely and of the estimate.
Posterior up_to_neighbours(Posterior posterior, const std::vector<Axis>& searched, unsigned seed = 1);

}  // namespace flash::sysid
