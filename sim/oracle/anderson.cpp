#include "sim/oracle/anderson.h"

#include <Eigen/QR>

namespace flash::sim {

void Anderson::reset() {
  x_.resize(0);
  dx_.clear();
  df_.clear();
}

Eigen::VectorXd Anderson::next(const Eigen::VectorXd& x, const Eigen::VectorXd& f) {
  if (x_.size() == x.size() && depth_ > 0) {
    dx_.push_back(x - x_);
    df_.push_back(f - f_);
    if (static_cast<int>(dx_.size()) > depth_) {
      dx_.pop_front();
      df_.pop_front();
    }
  }
  x_ = x;
  f_ = f;
  const Eigen::Index m = static_cast<Eigen::Index>(dx_.size());
  Eigen::VectorXd next = x + f;
  if (m == 0) return next;
  Eigen::MatrixXd gram(m, m);
  Eigen::VectorXd right(m);
  for (Eigen::Index i = 0; i < m; ++i) {
    right[i] = df_[i].dot(f);
    for (Eigen::Index j = 0; j < m; ++j) gram(i, j) = df_[i].dot(df_[j]);
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factor(m, m);
  factor.setThreshold(1e-12);  // drops directions that repeat others
  factor.compute(gram);
  const Eigen::VectorXd gamma = factor.solve(right);
  if (!gamma.allFinite()) return next;
  for (Eigen::Index i = 0; i < m; ++i) next -= gamma[i] * (dx_[i] + df_[i]);
  return next;
}

}  // namespace flash::sim
