#pragma once
#include <Eigen/Core>
#include <deque>

namespace flash::sim {

/// Anderson acceleration (type II) of a fixed-point iteration x <- x + f(x), after Walker and Ni 2011,
/// eq. 2.2. Least squares are taken in the inner product <f, r> of the caller, with r a second image of f (r
/// = f: the plain one).
class Anderson {
 public:
  explicit Anderson(int depth) : depth_(depth) {}

  void reset();

  /// The next iterate from x and f(x). With depth 0, or without a history, x + f.
  Eigen::VectorXd next(const Eigen::VectorXd& x, const Eigen::VectorXd& f);

 private:
  int depth_;
  Eigen::VectorXd x_, f_;                ///< the last iterate
  std::deque<Eigen::VectorXd> dx_, df_;  ///< differences, the newest last
};

}  // namespace flash::sim
