#pragma once
#include <Eigen/Core>

namespace flash::sysid {

// Numbers on which several steps of an answer agree.

/// Deviance over the least from which values count as unlikely: three standard deviations. Theory: chi-square
/// of one degree of freedom, 3^2.
inline constexpr double three_deviations = 9;

/// Of a distance over another, from which the other counts as nearer. Chosen: not varied.
inline constexpr double much_farther = 1.3;

/// Information of a direction over that of the best, below which it tells nothing. Work: rounding of an
/// information matrix.
inline constexpr double least_information = 1e-8;

/// Precision of an error that may be anything within its bounds, -1 to 1. Theory: stands for none, which
/// would leave a matrix singular.
inline constexpr double free_precision = 1e-6;

/// Draws of a posterior. Work: of so many independent ones, a quantile of 2.5 % is known
/// to 0.024 standard deviations.
inline constexpr Eigen::Index posterior_draws = 12'800;

/// The shortest reach of a discrepancy over the duration, or over the longest side of the sheet. Chosen: as
/// the other reaches of DiscrepancyModel, not varied.
inline constexpr double shortest_reach = 0.125;

}  // namespace flash::sysid
