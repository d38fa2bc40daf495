#include "sysid/emulate/tensor_spline.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

namespace flash::sysid {
namespace {

/// Four axes, of one, two, four and six knots.
TensorSpline random_spline(unsigned seed) {
  std::vector<Eigen::VectorXd> knots = {Eigen::VectorXd::Constant(1, 0.3), Eigen::Vector2d(-1, 2),
                                        Eigen::Vector4d(0, 0.2, 0.7, 1),
                                        Eigen::VectorXd::LinSpaced(6, -2, 3)};
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  return {knots, Eigen::VectorXd::NullaryExpr(48, [&](Eigen::Index) { return normal(random); })};
}

/// By the weights of all knots of each axis.
double by_all_knots(const TensorSpline& spline, const Eigen::Vector4d& x) {
  std::array<Eigen::RowVectorXd, 4> weights;
  for (Eigen::Index k = 0; k < 4; ++k)
    weights[static_cast<std::size_t>(k)] = Spline(spline.knots(k)).weights(x[k]);
  double sum = 0;
  Eigen::Index i = 0;
  for (const double a : weights[0])
    for (const double b : weights[1])
      for (const double c : weights[2])
        for (const double d : weights[3]) sum += a * b * c * d * spline.values()[i++];
  return sum;
}

TEST(TensorSpline, IsTheSumOverAllKnots) {
  const TensorSpline spline = random_spline(1);
  for (const Eigen::Vector4d& x : {Eigen::Vector4d(0.3, 0.1, 0.5, 0.4), Eigen::Vector4d(0.3, 2, 0.2, -2),
                                   Eigen::Vector4d(0.3, -1, 1, 3), Eigen::Vector4d(0.3, 1.9, 0.01, 2.99)})
    EXPECT_NEAR(spline(x), by_all_knots(spline, x), 1e-12);
}

TEST(TensorSpline, DerivativesAreThoseOfFiniteDifferences) {
  const TensorSpline spline = random_spline(2);
  const Eigen::Vector4d at(0.3, 0.4, 0.55, 1.3);
  Eigen::VectorXd gradient;
  Eigen::MatrixXd hessian;
  EXPECT_EQ(spline.derivatives(at, gradient, hessian), spline(at));
  constexpr double kStep = 1e-4;  // rounding of 1e-16 / kStep^2 and a truncation by kStep^2, of some tens
  const auto moved = [&](Eigen::Index i, double a, Eigen::Index j, double b) {
    Eigen::Vector4d x = at;
    x[i] += a * kStep;
    x[j] += b * kStep;
    return spline(x);
  };
  for (Eigen::Index i = 1; i < 4; ++i) {
    EXPECT_NEAR(gradient[i], (moved(i, 1, i, 0) - moved(i, -1, i, 0)) / (2 * kStep), 1e-6);
    for (Eigen::Index j = 1; j < 4; ++j)
      EXPECT_NEAR(hessian(i, j),
                  (moved(i, 1, j, 1) - moved(i, 1, j, -1) - moved(i, -1, j, 1) + moved(i, -1, j, -1)) /
                      (4 * kStep * kStep),
                  1e-5);
  }
  EXPECT_EQ(gradient[0], 0);  // of one knot
}

}  // namespace
}  // namespace flash::sysid
