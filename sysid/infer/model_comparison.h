#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "sysid/infer/adaptive_design.h"

namespace flash::sysid {

/// What the estimate of a search leaves of one recording. Searches of the same observations have the same
/// rows.
struct LeftResiduals {
  ObservedRows rows;      ///< without columns of errors or parameters
  Eigen::VectorXd left;   ///< once registration and errors of known shape are fitted [m]
  double error_cost = 0;  ///< -2 log prior of these errors, up to a constant
  double spread = 0;      ///< s of the search's likelihood [m]
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

/// What the observations tell of all that a search left open, about the reference of a likelihood:
/// eigenvalues of the information of its parameters, registration and known errors, each in units of its
/// prior's standard deviation, were the residuals' a metre [m^2]. `spreads`: of the searched parameters'
/// priors, in units of their rates. Recordings have their parameters in common, and each counts by 1 / s^2
/// over the mean of that.
Eigen::VectorXd open_information(const MotionLikelihood& likelihood, const std::vector<double>& spreads);

/// Share of its prior that residuals of standard deviation `spread` [m] leave likely, by Laplace, as a
/// logarithm.
double log_occupied(const Eigen::VectorXd& open_information, double spread);

/// Prior standard deviations of values that are anywhere in the ranges of the searched `axes` alike, in units
/// of rates over `extent`.
std::vector<double> spreads_over(const std::vector<Axis>& axes, const Extent& extent);

}  // namespace flash::sysid
