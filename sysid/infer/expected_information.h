#pragma once
#include <Eigen/Core>

#include "sysid/infer/discrepancy.h"

namespace flash::sysid {

/// What rows that are yet to be observed would tell of the parameters (`rows.rates`), judged as
/// ResidualLikelihood judges, where noise and discrepancy are those of `misfit`. Errors of known shape are
/// fitted beside them, `rows.free` with the standard deviation of what is even between -1 and 1. Every row
/// counts by itself, with the least spread s for which no direction claims more than it scatters by:
///
///     H / s^2,  H = G^T M G,  V = G^T M C M G,  s^2 = largest eigenvalue of H^-1/2 V H^-1/2
///
/// G: rates; M: weights, what is fitted beside them taken out; C: covariance of DiscrepancyModel.
Eigen::MatrixXd expected_information(const ObservedRows& rows, const Misfit& misfit);

}  // namespace flash::sysid
