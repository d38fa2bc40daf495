#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "sysid/infer/motion_likelihood.h"

namespace flash::sysid {

/// What the estimate of a search leaves of one recording. Searches of the same observations have the same
/// rows.
struct LeftResiduals {
  ObservedRows rows;      ///< without columns of errors or parameters
  Eigen::VectorXd left;   ///< once registration and errors of known shape are fitted [m]
  double error_cost = 0;  ///< -2 log prior of these errors, up to a constant
};

/// Of each recording, at the reference of a likelihood.
std::vector<LeftResiduals> left_residuals(const MotionLikelihood& likelihood);

/// -2 log likelihood of another model's estimate over that of a reference, summed over the recordings; see
/// ResidualLikelihood. What tells both apart is a direction like a parameter's: by the discrepancy of the
/// reference, s is the least for which the curvature along it claims no more than the residuals tell. So the
/// excess is about the square of how many standard deviations lie between the models (as in Vuong 1989).
/// `repeatability`: see DiscrepancyModel. Both have the same rows.
double excess_deviance(const std::vector<LeftResiduals>& reference, const std::vector<LeftResiduals>& other,
                       std::optional<double> repeatability = {});

/// Share of the prior that is likely, by Laplace: log of sqrt(det(2 pi C)) over the volume of the ranges, not
/// above zero for any parameter alone. `draws`: of the posterior, a draw a row; `widths`: of the ranges that
/// were alike likely before.
double log_occupied(const Eigen::MatrixXd& draws, const Eigen::VectorXd& widths);

}  // namespace flash::sysid
