#pragma once
#include <Eigen/Core>

namespace flash::sysid {

/// Cubic spline over given knots whose third derivative is continuous at the second and the last knot but one
/// (not-a-knot, de Boor 1978); a parabola through three knots, a line through two, a constant through one.
class Spline {
 public:
  /// `knots`: increasing, at least one.
  explicit Spline(Eigen::VectorXd knots);

  const Eigen::VectorXd& knots() const { return knots_; }

  /// Weights of the values at the knots in the spline's value (derivative 0), slope (1) or curvature (2) at
  /// t.
  Eigen::RowVectorXd weights(double t, int derivative = 0) const;
  void weights(double t, int derivative, Eigen::Ref<Eigen::RowVectorXd> weights) const;

 private:
  Eigen::VectorXd knots_;
  Eigen::MatrixXd second_;  // maps values at the knots to second derivatives there
};

}  // namespace flash::sysid
