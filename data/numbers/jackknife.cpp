#include "data/numbers/jackknife.h"

#include <Eigen/Cholesky>

namespace flash::data {

double jackknife_factor(const std::vector<GroupTerms>& groups, const Eigen::MatrixXd& information,
                        const Eigen::MatrixXd& metric) {
  double found = 0, expected = 0;
  for (const GroupTerms& group : groups) {
    const Eigen::LDLT<Eigen::MatrixXd> others(information - group.information);
    if (!others.isPositive() || !(others.vectorD().minCoeff() > 0)) return 1;
    const Eigen::VectorXd step = others.solve(group.gradient);
    found += step.dot(metric * step);
    // (I - I_i)^-1 - I^-1 = (I - I_i)^-1 I_i I^-1, without the difference of two large numbers.
    expected += information.ldlt().solve(metric * others.solve(group.information)).trace();
  }
  return expected > 0 ? found / expected : 1;
}

}  // namespace flash::data
