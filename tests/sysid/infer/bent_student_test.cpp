#include "sysid/infer/bent_student.h"

#include <gtest/gtest.h>

#include <cmath>

namespace flash::sysid {
namespace {

BentStudent crooked() {
  BentStudent student;
  student.mean = Eigen::Vector2d(0.2, -0.1);
  student.along = Eigen::Vector2d(1, 1);
  student.bend = Eigen::Vector2d(0.3, -0.3);
  student.root = (Eigen::Matrix2d() << 0.8, 0, -0.2, 0.4).finished();
  return student;
}

/// A draw a row.
Eigen::MatrixXd draws_of(const BentStudent& student, Eigen::Index count, unsigned seed) {
  RandomNumbers random(seed);
  Eigen::MatrixXd draws(count, student.mean.size());
  for (auto draw : draws.rowwise()) draw = student.draw(random).transpose();
  return draws;
}

TEST(BentStudent, DensityHasTheMassOfDraws) {
  const BentStudent student = crooked();
  constexpr int kCells = 600;
  constexpr double kEnd = 3;
  Eigen::MatrixXd cells(kCells * kCells, 2);
  const auto place = [&](int i) { return kEnd * (2 * (i + 0.5) / kCells - 1); };
  for (int i = 0; i < kCells; ++i)
    for (int j = 0; j < kCells; ++j) cells.row(i * kCells + j) << place(i), place(j);
  const Eigen::ArrayXd mass = student.densities(cells) * std::pow(2 * kEnd / kCells, 2);
  constexpr int kDraws = 40'000;
  const Eigen::MatrixXd draws = draws_of(student, kDraws, 1);
  // The square, and the half of it that the parabola bends into.
  const auto inside = [&](const Eigen::MatrixXd& points) -> Eigen::ArrayXd {
    return (points.array().abs().rowwise().maxCoeff() < kEnd).cast<double>();
  };
  const auto right = [&](const Eigen::MatrixXd& points) -> Eigen::ArrayXd {
    return inside(points) * (points.col(0).array() - points.col(1).array() > 0.8).cast<double>();
  };
  // Four standard deviations of a share of the draws, and 1e-3 for cells across the line.
  for (const double share :
       {inside(draws).mean() - mass.sum(), right(draws).mean() - (mass * right(cells)).sum()})
    EXPECT_NEAR(share, 0, 4 * 0.5 / std::sqrt(kDraws) + 1e-3);
}

TEST(BentStudent, FitFindsTheParabolaThatPointsLieAlong) {
  // Gaussian draws, bent as `crooked` is: fitted in other coordinates, along and bend are the same.
  const BentStudent exact = crooked();
  constexpr Eigen::Index kCount = 20'000;
  RandomNumbers random(2);
  Eigen::MatrixXd points(kCount, 2);
  for (auto point : points.rowwise()) {
    const Eigen::Vector2d r = exact.root * Eigen::Vector2d(random.normal(), random.normal());
    point = (exact.mean + r + exact.bend * std::pow(exact.along.dot(r), 2)).transpose();
  }
  const Eigen::VectorXd weights = Eigen::VectorXd::Constant(kCount, 1.0 / kCount);
  const BentStudent fitted = fitted_student(points, weights, Eigen::Matrix2d::Identity());
  // `along` and `bend` are one up to the length of `along`, and what the search for the direction leaves.
  const double length = fitted.along.dot(exact.along) / exact.along.squaredNorm();
  EXPECT_LT((fitted.along / length - exact.along).norm(), 0.03);
  EXPECT_LT((fitted.bend * length * length - exact.bend).norm(), 0.03);
  EXPECT_LT((fitted.mean - exact.mean).norm(), 0.03);
  EXPECT_LT((fitted.root * fitted.root.transpose() - exact.root * exact.root.transpose()).norm(), 0.03);
  EXPECT_NEAR(fitted.along.dot(fitted.bend), 0, 1e-9);
}

TEST(BentStudent, FitToFewStraightPointsIsStraight) {
  int straight = 0;
  constexpr int kSeeds = 100;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    RandomNumbers random(seed);
    Eigen::MatrixXd points(100, 3);
    for (double& each : points.reshaped()) each = random.normal();
    const BentStudent fitted =
        fitted_student(points, Eigen::VectorXd::Constant(100, 0.01), Eigen::Matrix3d::Identity());
    straight += fitted.bend.norm() == 0;
  }
  EXPECT_GE(straight, 90);
}

}  // namespace
}  // namespace flash::sysid
