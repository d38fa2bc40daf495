#include "sysid/infer/cluster_variance.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <random>

#include "sysid/infer/profile.h"

namespace flash::sysid {
namespace {

TEST(ClusterVariance, OfEqualWeightAreTheClassicalVarianceAndFreedom) {
  for (const int n : {2, 5, 20}) {
    const std::vector<Eigen::MatrixXd> information(static_cast<std::size_t>(n),
                                                   Eigen::MatrixXd::Constant(1, 1, 0.3));
    Eigen::MatrixXd slopes = Eigen::VectorXd::LinSpaced(n, -1, 1);  // adds up to zero
    const ClusterVariance found = cluster_variance(slopes, information).front();
    EXPECT_NEAR(found.variance, n / (n - 1.0), 1e-9);
    EXPECT_NEAR(found.freedom, n - 1, 1e-6);
  }
}

TEST(ClusterVariance, OfUnequalWeightHoldTheTruthAsOftenAsPromised) {
  // Thirteen keyframes that tell two parameters the more the later they are; slopes of a least-squares fit.
  constexpr int kKeyframes = 13, kTrials = 4000;
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  std::vector<Eigen::MatrixXd> information;
  Eigen::Matrix2d total = Eigen::Matrix2d::Zero();
  for (int k = 0; k < kKeyframes; ++k) {
    const double t = k / 12.0;
    Eigen::Matrix2d rows;
    rows << t * t, 0.7 * t * t * t, 0.2 * t, t * t * t;
    information.push_back(rows.transpose() * rows);
    total += information.back();
  }
  const Eigen::Matrix2d inverse = total.inverse();
  int plain = 0, corrected = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    Eigen::MatrixXd slopes(kKeyframes, 2);
    for (int k = 0; k < kKeyframes; ++k) {
      const Eigen::Matrix2d root =
          Eigen::LLT<Eigen::Matrix2d>(information[static_cast<std::size_t>(k)] + 1e-14 * total).matrixL();
      slopes.row(k) = (root * Eigen::Vector2d(normal(random), normal(random))).transpose();
    }
    const Eigen::Vector2d error = inverse * slopes.colwise().sum().transpose();
    for (int k = 0; k < kKeyframes; ++k)
      slopes.row(k) -= (information[static_cast<std::size_t>(k)] * error).transpose();
    const double variance = (slopes * inverse.col(0)).squaredNorm();
    const ClusterVariance few = cluster_variance(slopes, information).front();
    const auto inside = [&](double v, double freedom) {
      return std::abs(error[0]) < student_quantile(std::max(1.0, freedom)) * std::sqrt(v);
    };
    plain += inside(variance * kKeyframes / (kKeyframes - 1.0), kKeyframes - 2);
    corrected += inside(variance * few.variance, few.freedom);
  }
  // Three standard errors of a share of 4,000: 0.011. Satterthwaite's freedom errs to the safe side.
  EXPECT_LT(plain, 0.92 * kTrials);
  EXPECT_GT(corrected, 0.94 * kTrials);
  EXPECT_LT(corrected, 0.985 * kTrials);
}

}  // namespace
}  // namespace flash::sysid
