#pragma once
#include <Eigen/Core>
#include <array>

namespace flash::sysid {

/// Cubic spline over given knots whose third derivative is continuous at the second and the last knot but one
/// (not-a-knot, de Boor 1978); a parabola through three knots, a line through two, a constant through one.
class Spline {
 public:
  /// `knots`: increasing, at least one.
  explicit Spline(Eigen::VectorXd knots);

  const Eigen::VectorXd& knots() const { return knots_; }

  /// What value (derivative 0), slope (1) or curvature (2) at t are made of: values and curvatures at the
  /// knots below and above, which are one where there is one knot only.
  struct Local {
    std::array<Eigen::Index, 2> knots;
    std::array<double, 2> values, curvatures;  ///< weights
  };
  Local local(double t, int derivative = 0) const;

  /// Maps values at the knots to curvatures there.
  const Eigen::MatrixXd& curvatures() const { return second_; }

  /// Weights of the values at the knots in the spline's value (derivative 0), slope (1) or curvature (2) at
  /// t.
  Eigen::RowVectorXd weights(double t, int derivative = 0) const;

 private:
  Eigen::VectorXd knots_;
  Eigen::MatrixXd second_;
};

}  // namespace flash::sysid
