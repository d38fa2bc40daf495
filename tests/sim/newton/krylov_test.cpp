#include "sim/newton/krylov.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "sim/plan/sheet_plan.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// A positive definite matrix over a sheet, in the precision Scalar and as it is, vertices as the mesh has
/// them.
template <typename Scalar>
struct Example {
  Sheet sheet = small_sheet(5);
  std::shared_ptr<const SheetPlan> plan = make_sheet_plan(sheet);
  std::mt19937 random{7};
  const std::vector<int>& position = plan->symbolic->position;
  long size = 3L * plan->pattern.size;
  BlockValues<double> values;
  MatrixXd dense = MatrixXd::Zero(size, size);
  SheetProduct<Scalar> product{*plan->kernels};
  BlockCholesky<float> preconditioner{plan->symbolic, *plan->kernels};

  Example() {
    const auto put = [&](int i, int j, const Matrix3d& block) {
      values.insert(values.end(), block.data(), block.data() + 9);
      dense.block<3, 3>(3L * i, 3L * j) = block;
      dense.block<3, 3>(3L * j, 3L * i) = block.transpose();
    };
    for (int i = 0; i < plan->pattern.size; ++i) {
      const Matrix3d block = noise();
      put(i, i, block * block.transpose() + 30 * (1 + i % 7) * Matrix3d::Identity());
    }
    for (const auto& [i, j] : plan->pattern.pairs) put(i, j, noise());
    product.assign(plan->full_product, values, {});
    // The factor of the identity: far enough from the matrix to take several iterations.
    BlockValues<double> identity(values.size(), 0.0);
    for (int i = 0; i < plan->pattern.size; ++i)
      for (int c = 0; c < 3; ++c) identity[9L * i + 4 * c] = 1;
    EXPECT_TRUE(preconditioner.factorize(identity));
  }

  Matrix3d noise() {
    std::uniform_real_distribution<double> entry(-1, 1);
    return Matrix3d::NullaryExpr([&] { return entry(random); });
  }

  OrderedVector<Scalar> ordered(const VectorXd& x) const {
    OrderedVector<Scalar> result = OrderedVector<Scalar>::Zero(4 * size / 3);
    for (int i = 0; i < plan->pattern.size; ++i)
      result.template segment<3>(4L * position[i]) = x.segment<3>(3L * i).template cast<Scalar>();
    return result;
  }
  VectorXd numbered(const OrderedVector<Scalar>& x) const {
    VectorXd result(size);
    for (int i = 0; i < plan->pattern.size; ++i)
      result.segment<3>(3L * i) = x.template segment<3>(4L * position[i]).template cast<double>();
    return result;
  }
};

/// Vertex 1 stays, vertex 4 moves in a plane, vertex 9 along a line; all have to make a displacement.
/// `coupled`: friction grows with the force on vertices 4 and 9.
template <typename Scalar>
void expect_a_tenth(bool coupled) {
  Example<Scalar> example;
  const Vector3d normal = Vector3d(1, 2, -1).normalized(), edge = Vector3d(0, 1, 1).normalized();
  const std::vector<std::pair<int, Matrix3d>> restrictions = {
      {1, Matrix3d::Zero()},
      {4, Matrix3d::Identity() - normal * normal.transpose()},
      {9, edge * edge.transpose()}};
  MatrixXd free = MatrixXd::Identity(example.size, example.size), left = free;
  VectorXd start = VectorXd::Zero(example.size);
  std::vector<VertexMatrix<Scalar>> free_list, left_list;
  for (const auto& [vertex, projector] : restrictions) {
    Matrix3d row = projector;
    if (coupled && vertex != 1) row += 0.3 * projector * example.noise() * (Matrix3d::Identity() - projector);
    free.block<3, 3>(3L * vertex, 3L * vertex) = projector;
    left.block<3, 3>(3L * vertex, 3L * vertex) = row;
    start.segment<3>(3L * vertex) = (Matrix3d::Identity() - projector) * Vector3d(0.1, -0.2, 0.3);
    free_list.emplace_back(example.position[vertex], projector);
    left_list.emplace_back(example.position[vertex], row);
  }
  const VectorXd right = VectorXd::LinSpaced(example.size, -1, 2);
  const RestrictedProblem<Scalar> problem{example.product,        example.preconditioner, free_list,
                                          example.ordered(right), example.ordered(start), 0};
  const KrylovSolution<Scalar> solution =
      coupled ? gmres(problem, left_list) : conjugate_gradients(problem, *example.plan->kernels);

  const VectorXd x = example.numbered(solution.x);
  const auto residual = [&](const VectorXd& at) -> VectorXd {
    return free * right - left * example.dense * at;
  };
  // Rounding of products with rows of at most 100 numbers, below 300 in magnitude.
  const double rounding = 100 * 300 * std::numeric_limits<Scalar>::epsilon() * x.norm();
  EXPECT_GE(solution.solves, 2);
  EXPECT_LE(residual(x).norm(), 0.1 * residual(start).norm() + rounding);
  EXPECT_LE((x - free * x - start).norm(), rounding);
  EXPECT_LE((example.numbered(solution.image) - example.dense * x).norm(), rounding);
}

TEST(Krylov, ConjugateGradientsSolveToATenthInTheFreeDirections) {
  expect_a_tenth<float>(false);
  expect_a_tenth<double>(false);
}

TEST(Krylov, TheGeneralizedMinimalResidualSolvesToATenthWhereRowsAreCoupled) {
  expect_a_tenth<float>(true);
  expect_a_tenth<double>(true);
}

TEST(Krylov, ConjugateGradientsStopWhereTheMatrixCurvesDown) {
  Example<double> example;
  BlockValues<double> down = example.values;
  for (double& value : down) value = -value;
  example.product.assign(example.plan->full_product, down, {});
  const VectorXd right = VectorXd::LinSpaced(example.size, -1, 2);
  const RestrictedProblem<double> problem{example.product,
                                          example.preconditioner,
                                          {},
                                          example.ordered(right),
                                          OrderedVector<double>::Zero(4 * example.size / 3),
                                          0};
  const KrylovSolution<double> solution = conjugate_gradients(problem, *example.plan->kernels);
  EXPECT_EQ(solution.solves, 1);
  EXPECT_GT(example.numbered(solution.x).dot(right), 0);  // still a way down
}

/// A problem whose eigenvalues stand over eight decades, those of its preconditioner in one place. What a
/// polynomial of the matrix that is one at zero leaves of the vectors of its small eigenvalues is most of
/// them: more than half.
template <typename Solve>
int solves_of_a_hard_problem(const Solve& solve) {
  Example<double> example;
  for (std::size_t k = 0; k < example.values.size(); ++k) example.values[k] = 0;
  for (int i = 0; i < example.plan->pattern.size; ++i)
    for (int c = 0; c < 3; ++c)
      example.values[9L * i + 4 * c] = std::pow(10.0, 8.0 * (3 * i + c) / static_cast<double>(example.size));
  example.product.assign(example.plan->full_product, example.values, {});
  const VectorXd right = VectorXd::Ones(example.size);
  return solve(RestrictedProblem<double>{example.product,
                                         example.preconditioner,
                                         {},
                                         example.ordered(right),
                                         OrderedVector<double>::Zero(4 * example.size / 3),
                                         0},
               *example.plan->kernels)
      .solves;
}

TEST(Krylov, ConjugateGradientsTakeTwentySolvesAtMost) {
  EXPECT_EQ(solves_of_a_hard_problem([](const auto& problem, const Kernels& kernels) {
              return conjugate_gradients(problem, kernels);
            }),
            20);
}

TEST(Krylov, TheGeneralizedMinimalResidualKeepsFortyDirectionsAtMost) {
  EXPECT_EQ(solves_of_a_hard_problem([](const auto& problem, const Kernels&) { return gmres(problem, {}); }),
            40);
}

}  // namespace
}  // namespace flash::sim
