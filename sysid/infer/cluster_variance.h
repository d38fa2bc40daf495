#pragma once
#include <Eigen/Core>
#include <vector>

namespace flash::sysid {

/// What the scatter of a few keyframes of unequal weight says of one parameter.
struct ClusterVariance {
  double variance = 1;  ///< by how much the plain sum of squares has to be multiplied
  double freedom = 0;   ///< degrees of freedom of that variance
};

/// The fit makes the slopes of its keyframes add up to zero, so that their scatter is too small, most of all
/// where a few keyframes tell a parameter alone. Bias-reduced variance (CR2, Bell and McCaffrey 2002) and its
/// degrees of freedom (Satterthwaite 1946) under errors that every keyframe has by its information.
/// `slopes`: of the weighted scores of the keyframes at the estimate, one row each. `information`: of each
/// keyframe, in any unit common to all. One entry a parameter.
std::vector<ClusterVariance> cluster_variance(const Eigen::MatrixXd& slopes,
                                              const std::vector<Eigen::MatrixXd>& information);

/// 97.5 % quantile of Student's distribution: Abramowitz and Stegun 26.7.5 beyond 4 degrees of freedom, below
/// between tabulated ones, its logarithm linear in 1 / freedom. Infinite below one.
double student_quantile(double freedom);

}  // namespace flash::sysid
