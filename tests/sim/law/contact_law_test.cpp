#include "sim/law/contact_law.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>
#include <vector>

namespace flash::sim {
namespace {

TEST(ContactLaw, FewEquationsAreSolvedAsByAFactorization) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(-1, 1);
  for (int sample = 0; sample < 3000; ++sample) {
    FewEquations<double> equations;
    equations.size = 1 + sample % 3;
    Eigen::MatrixXd matrix(equations.size, equations.size);
    Eigen::VectorXd right(equations.size);
    for (int r = 0; r < equations.size; ++r) {
      right[r] = equations.right[r] = number(random);
      for (int c = 0; c < equations.size; ++c) matrix(r, c) = equations.matrix[r][c] = number(random);
    }
    double x[3];
    const double determinant = matrix.determinant();
    ASSERT_EQ(solve(equations, 1e-3, x), std::abs(determinant) >= 1e-3);
    if (std::abs(determinant) < 1e-3) continue;
    const Eigen::VectorXd expected = matrix.partialPivLu().solve(right);
    // Rounding times the condition of the matrix, which is below 20 over the determinant.
    const double rounding = 1e-14 * expected.norm() / std::abs(determinant);
    for (int k = 0; k < equations.size; ++k) EXPECT_NEAR(x[k], expected[k], rounding);
  }
}

TEST(ContactLaw, AFaceAlonePushesAsMuchAsIsNeededAndNeverPulls) {
  const Vector3<double> normal{0, 0.6, 0.8}, rubbing{0.3, 0.6, 0.8}, along{0, 0.8, -0.6};
  EXPECT_EQ(solve_lcp_of_one(normal, normal, 3.0), 3 / dot(normal, normal));
  // Its friction is across the normal, so that it changes nothing.
  EXPECT_EQ(solve_lcp_of_one(normal, rubbing, 3.0), 3 / dot(normal, normal));
  EXPECT_EQ(solve_lcp_of_one(normal, normal, -3.0), 0);
  EXPECT_EQ(solve_lcp_of_one(normal, normal, 0.0), 0);
  EXPECT_EQ(solve_lcp_of_one(normal, along, 3.0), 0);
  EXPECT_EQ(solve_lcp_of_one(normal, normal, std::nan("")), 0);
}

TEST(ContactLaw, RubbingSurfacesMeetTheConditionsOfComplementarity) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> number(-1, 1);
  const auto draw = [&] { return Vector3<double>{number(random), number(random), number(random)}; };
  int several = 0, solvable = 0;
  for (int sample = 0; sample < 5000; ++sample) {
    const int count = 1 + sample % 5;
    std::vector<Vector3<double>> normals, directions;
    std::vector<double> b, x(static_cast<std::size_t>(count));
    const Vector3<double> needed = draw();
    for (int k = 0; k < count; ++k) {
      Vector3<double> normal = draw();
      normal = (1 / norm(normal)) * normal;
      const Vector3<double> across = cross(normal, draw());
      normals.push_back(normal);
      directions.push_back(normal - (0.2 / norm(across)) * across);  // friction of 0.2
      b.push_back(dot(normal, needed));
    }
    solve_lcp(count, normals.data(), directions.data(), b.data(), x.data());
    Vector3<double> sum{};
    int positive = 0;
    for (int k = 0; k < count; ++k) {
      EXPECT_GE(x[k], 0);
      positive += x[k] > 0;
      sum = sum + x[k] * directions[k];
    }
    several += positive > 1;
    EXPECT_LE(positive, 3);
    double violation = 0;
    for (int k = 0; k < count; ++k) {
      const double y = dot(normals[k], sum) - b[k];
      violation = std::max(violation, -y);
      // Rounding over a determinant of 1e-6 at least.
      EXPECT_NEAR(x[k] * y, 0, 1e-8 * (1 + x[k]));
    }
    // One surface or two whose matrix has positive minors always have a solution.
    const auto entry = [&](int i, int j) { return dot(normals[i], directions[j]); };
    if (count == 1 || (count == 2 && 1 - entry(0, 1) * entry(1, 0) > 1e-2)) {
      EXPECT_LE(violation, 1e-12) << sample;
      ++solvable;
    }
  }
  EXPECT_GT(several, 1000);
  EXPECT_GT(solvable, 1500);
}

}  // namespace
}  // namespace flash::sim
