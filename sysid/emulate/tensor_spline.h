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
  /// Derivative along axes i and j, none where they are negative.
  double contract(const Eigen::VectorXd& x, Eigen::Index i = -1, Eigen::Index j = -1) const;
  /// The part of axis k and those behind it, at a node of those before; `along`: axes before k of which the
  /// curvature is asked for, a bit each.
  double sum(const std::vector<Spline::Local>& at, std::size_t k, Eigen::Index node,
             Eigen::Index along) const;

  std::vector<Spline> splines_;
  Eigen::VectorXd values_;
  /// Of each point, a column, the curvatures along any set of axes, of which each has a bit: few are read for
  /// a value.
  Eigen::MatrixXd curvatures_;
};

}  // namespace flash::sysid
