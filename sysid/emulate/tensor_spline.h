#pragma once
#include <Eigen/Core>
#include <vector>

#include "sysid/emulate/spline.h"

namespace flash::sysid {

/// A number between the points of a grid: tensor-product cubic splines (Spline).
class TensorSpline {
 public:
  /// `knots`: of each coordinate, increasing. `values`: one a point, the last coordinate fastest.
  TensorSpline(const std::vector<Eigen::VectorXd>& knots, Eigen::VectorXd values);

  Eigen::Index dimensions() const { return static_cast<Eigen::Index>(splines_.size()); }
  const Eigen::VectorXd& knots(Eigen::Index k) const { return splines_[static_cast<std::size_t>(k)].knots(); }
  const Eigen::VectorXd& values() const { return values_; }

  double operator()(const Eigen::VectorXd& x) const;
  double derivatives(const Eigen::VectorXd& x, Eigen::VectorXd& gradient, Eigen::MatrixXd& hessian) const;

  /// The lowest value that Newton's method inside the grid reaches from x, which it moves there.
  double minimize(Eigen::VectorXd& x) const;

 private:
  double contract(const Eigen::VectorXd& x, const std::vector<int>& derivatives) const;

  std::vector<Spline> splines_;
  Eigen::VectorXd values_;
};

}  // namespace flash::sysid
