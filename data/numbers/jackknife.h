#pragma once
#include <Eigen/Core>
#include <vector>

namespace flash::data {

/// What one group of observations says of s unknowns, linearised at their estimate, in units of its variance.
struct GroupTerms {
  Eigen::MatrixXd information;  ///< s x s
  Eigen::VectorXd gradient;     ///< of half the sum of squares
};

/// By how much estimates scatter more than their groups say, as one group after the other is left out: d is
/// the step that the unknowns take without it,
///     f = sum d^T W d / sum tr(W ((I - I_i)^-1 - I^-1)),  d = (I - I_i)^-1 g_i.
/// The mean is 1 where each group scatters as its information I_i says (the jackknife, of one step of Newton,
/// over its mean: Quenouille 1956, MacKinnon and White 1985), and larger where what is in a group errs
/// together. information: I, of all groups and what is known beforehand; metric: W, positive, of the
/// directions that count. 1 where the unknowns are not determined without some group.
double jackknife_factor(const std::vector<GroupTerms>& groups, const Eigen::MatrixXd& information,
                        const Eigen::MatrixXd& metric);

}  // namespace flash::data
