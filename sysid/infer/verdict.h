#pragma once
#include <Eigen/Core>
#include <vector>

#include "sysid/emulate/grid_results.h"
#include "sysid/infer/finding.h"
#include "sysid/infer/posterior.h"

namespace flash::sysid {

/// What a posterior says of each parameter. `searched`: the range that the posterior may use.
///
/// A side of an interval is told where the likelihood falls by 1.92 in its logarithm before the end of the
/// range, whatever the other parameters do: there the interval ends at the 2.5 % or 97.5 % quantile of the
/// posterior, or at the estimate where that lies beyond. On another side it ends with the range. `bits` is
/// the information gained: log2 of the width of what is usual for the parameter (usual_range, in the unit
/// that `base` gives it) over that of the interval, which an open side takes to the end of the usual. A wider
/// range says the same. Below one bit a parameter is not told, nor bounded.
std::vector<ParameterFinding> findings_of(const GridResults& results, const std::vector<Axis>& searched,
                                          const Posterior& posterior, const MaterialBase& base);

/// Of a search without a posterior: nothing is told.
std::vector<ParameterFinding> findings_without_posterior(const GridResults& results,
                                                         const std::vector<double>& values);

/// The draws as values of the parameters.
Eigen::MatrixXd samples_of(const Posterior& posterior);

/// Covariance of the logarithms of the parameters over the draws; empty where a range reaches zero.
Eigen::MatrixXd covariance_of_logarithms(const Posterior& posterior);

}  // namespace flash::sysid
