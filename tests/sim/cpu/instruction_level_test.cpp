#include "sim/cpu/instruction_level.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include "sim/cpu/kernels.h"
#include "sim/law/membrane.h"
#include "sim/step/elastic_energy.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using data::Constitutive;
using data::Points;

constexpr double epsilon = std::numeric_limits<double>::epsilon();

Points noise(int rows, double size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> entry(-size, size);
  return Points::NullaryExpr(rows, 3, [&] { return entry(random); });
}

/// The membrane triangle by triangle, by the formulas for one F.
struct BruteForce {
  double energy = 0;
  Points gradient;
  Eigen::MatrixXd hessian;
  // Of what the sums above are made.
  double energies = 0;
  Points forces;
  Eigen::MatrixXd stiffnesses;

  BruteForce(const Sheet& sheet, const data::SheetMaterial& material, const Points& x, Curvature curvature)
      : gradient(Points::Zero(x.rows(), 3)),
        hessian(Eigen::MatrixXd::Zero(3 * x.rows(), 3 * x.rows())),
        forces(gradient),
        stiffnesses(hessian) {
    const SheetLame lame = sheet_lame(material.membrane_stiffness, material.poissons_ratio);
    const double stiffness = 2 * lame.mu + std::abs(lame.lambda);
    for (const RestTriangle& triangle : sheet.triangles) {
      Eigen::Matrix<double, 3, 2> w;
      w.bottomRows<2>() = triangle.inverse_edges;
      w.row(0) = -w.row(1) - w.row(2);
      Matrix32 F = Matrix32::Zero();
      for (int k = 0; k < 3; ++k) F += x.row(triangle.vertices[k]).transpose() * w.row(k);
      double density;
      Matrix32 stress;
      Matrix66 H;
      membrane_response(material.constitutive, F, lame, density, stress, &H, curvature);
      energy += triangle.area * density;
      energies += triangle.area * stiffness;
      for (int i = 0; i < 3; ++i) {
        gradient.row(triangle.vertices[i]) += triangle.area * (stress * w.row(i).transpose()).transpose();
        forces.row(triangle.vertices[i]).array() += triangle.area * stiffness * w.row(i).norm();
        for (int j = 0; j < 3; ++j) {
          auto block = hessian.block<3, 3>(3 * triangle.vertices[i], 3 * triangle.vertices[j]);
          for (int a = 0; a < 2; ++a)
            for (int b = 0; b < 2; ++b)
              block += triangle.area * w(i, a) * w(j, b) * H.block<3, 3>(3 * a, 3 * b);
          stiffnesses.block<3, 3>(3 * triangle.vertices[i], 3 * triangle.vertices[j]).array() +=
              triangle.area * stiffness * w.row(i).norm() * w.row(j).norm();
        }
      }
    }
  }
};

Eigen::MatrixXd dense(const BlockPattern& pattern, const BlockValues<double>& values) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(3L * pattern.size, 3L * pattern.size);
  const auto block = [&](size_t k) { return Eigen::Map<const Eigen::Matrix3d>(values.data() + 9 * k); };
  for (int i = 0; i < pattern.size; ++i) matrix.block<3, 3>(3 * i, 3 * i) = block(i);
  for (size_t k = 0; k < pattern.pairs.size(); ++k) {
    const auto [row, column] = pattern.pairs[k];
    matrix.block<3, 3>(3 * row, 3 * column) = block(pattern.size + k);
    matrix.block<3, 3>(3 * column, 3 * row) = block(pattern.size + k).transpose();
  }
  return matrix;
}

// A strain comes from places by some ten operations, each response from it by some thirty more: their
// roundings, all the same way, of quantities up to the stiffness.
constexpr double roundings = 100 * epsilon;

TEST(InstructionLevel, MembranesAreThoseOfTheFormulasForOneTriangle) {
  const Sheet sheet = small_sheet(5);
  const int size = static_cast<int>(sheet.rest.vertices.rows());
  for (const InstructionLevel level : instruction_levels()) {
    SCOPED_TRACE(to_string(level));
    const auto plan = make_sheet_plan(sheet, level);
    EXPECT_EQ(plan->kernels, &kernels_of(level));
    for (const Constitutive constitutive : {Constitutive::tri_arap, Constitutive::tri_corotated,
                                            Constitutive::tri_stvk, Constitutive::tri_neohookean}) {
      data::SheetMaterial material;
      material.constitutive = constitutive;
      const BendingOperator& bending =
          bending_operator(*plan, material.bending_model, material.poissons_ratio);
      const BodyLaw law{plan->bodies[0], material, bending};
      const Points x = 1.02 * sheet.rest.vertices + noise(size, 2e-3, 4);
      for (const Curvature curvature : {Curvature::exact, Curvature::positive}) {
        const BruteForce expected(sheet, material, x, curvature);
        Points gradient = Points::Zero(size, 3);
        material.bending_rigidity = 0;
        const ElasticEnergy energy = add_elastic_gradient(*plan, law, x, gradient);
        EXPECT_NEAR(energy.membrane, expected.energy, roundings * expected.energies);
        EXPECT_TRUE(
            ((gradient - expected.gradient).array().abs() <= roundings * expected.forces.array()).all());
        BlockValues<double> values(9 * (plan->pattern.size + plan->pattern.pairs.size()), 0.0);
        add_elastic_hessian(*plan, law, x, 1.0, curvature, values);
        const Eigen::MatrixXd difference = dense(plan->pattern, values) - expected.hessian;
        EXPECT_TRUE((difference.array().abs() <= roundings * expected.stiffnesses.array()).all())
            << difference.cwiseAbs().cwiseQuotient(expected.stiffnesses.cwiseMax(1e-300)).maxCoeff() /
                   epsilon;
      }
    }
  }
}

// gamma_n = n epsilon of a sum of n products (Higham 2002, section 3.1), and one rounding of each number.
template <typename Scalar>
void expect_matrix_products(const Kernels& kernels) {
  const Sheet sheet = small_sheet(7);
  const auto plan = make_sheet_plan(sheet);
  const int size = plan->pattern.size;
  const std::vector<int>& position = plan->symbolic->position;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> entry(-1, 1);
  BlockValues<double> values(9 * (size + plan->pattern.pairs.size()));
  for (double& value : values) value = entry(random);
  const Eigen::MatrixXd matrix = dense(plan->pattern, values);
  SheetProduct<Scalar> product(kernels);
  product.assign(plan->full_product, values, {});
  Eigen::Matrix<Scalar, Eigen::Dynamic, 1> x = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>::Zero(4 * size),
                                           y = x;
  Eigen::VectorXd in_order(3 * size), result(3 * size);
  for (int i = 0; i < size; ++i)
    for (int c = 0; c < 3; ++c)
      x[4 * position[i] + c] = static_cast<Scalar>(in_order[3 * i + c] = entry(random));
  product.multiply(x.data(), y.data());
  for (int i = 0; i < size; ++i)
    for (int c = 0; c < 3; ++c) result[3 * i + c] = y[4 * position[i] + c];
  const Eigen::VectorXd expected = matrix * in_order, magnitude = matrix.cwiseAbs() * in_order.cwiseAbs();
  const double terms = 3.0 * 20;  // of a row: vertices have at most 20 neighbours here
  const double bound = (terms + 2) * std::numeric_limits<Scalar>::epsilon();
  EXPECT_TRUE(((result - expected).array().abs() <= bound * magnitude.array()).all());

  const LinearKernels<Scalar>& own = linear<Scalar>(kernels);
  const long n = x.size() - 5;  // not whole vectors
  const double dot = x.head(n).template cast<double>().dot(y.head(n).template cast<double>());
  EXPECT_NEAR(
      own.dot(n, x.data(), y.data()), dot,
      static_cast<double>(n) * std::numeric_limits<Scalar>::epsilon() *
          x.head(n).template cast<double>().cwiseAbs().dot(y.head(n).template cast<double>().cwiseAbs()));
  Eigen::Matrix<Scalar, Eigen::Dynamic, 1> sum = y, other = y;
  own.add_scaled(n, Scalar(0.3), x.data(), sum.data());
  own.scale_and_add(n, Scalar(0.3), x.data(), other.data());
  const Scalar rounding =
      2 * std::numeric_limits<Scalar>::epsilon() * (x.cwiseAbs() + y.cwiseAbs()).maxCoeff();
  EXPECT_LE((sum - y - Scalar(0.3) * x).head(n).cwiseAbs().maxCoeff(), rounding);
  EXPECT_LE((other - x - Scalar(0.3) * y).head(n).cwiseAbs().maxCoeff(), rounding);
  EXPECT_EQ(sum.tail(5), y.tail(5));
  EXPECT_EQ(other.tail(5), y.tail(5));
}

TEST(InstructionLevel, ProductsAreThoseOfTheDenseMatrix) {
  for (const InstructionLevel level : instruction_levels()) {
    SCOPED_TRACE(to_string(level));
    expect_matrix_products<float>(kernels_of(level));
    expect_matrix_products<double>(kernels_of(level));
  }
}

// A sheet swings down about an edge that is held: stiff enough not to buckle, where rounding would decide
// which way it goes. So rounding moves an iterate by far less than the tolerance of a step.
TEST(InstructionLevel, SheetsTakeTheSameIterations) {
  const Sheet sheet = small_sheet(9, 0.2);
  std::vector<int> expected;
  Points expected_end;
  for (const InstructionLevel level : instruction_levels()) {
    SCOPED_TRACE(to_string(level));
    Environment environment = environment_of(sheet);
    environment.materials[0].bending_rigidity = 1e-2;
    environment.materials[0].air_drag = 1;
    for (int i = 0; i < sheet.rest.vertices.rows(); ++i)
      if (sheet.rest.vertices(i, 0) == 0)
        environment.holds.push_back(support(i, {true, true, true}, sheet.rest.vertices.row(i)));
    Solver solver(make_sheet_plan(sheet, level), SolverSettings{});
    std::vector<int> iterations;
    for (int k = 0; k < 40; ++k) {
      const StepReport report = solver.step(environment);
      EXPECT_TRUE(report.converged) << "step " << k;
      iterations.push_back(report.iterations);
    }
    if (expected.empty()) {
      expected = iterations;
      expected_end = environment.state.positions;
    }
    EXPECT_EQ(iterations, expected);
    // Steps end within the tolerance of 1e-3 g on the acceleration, and nothing amplifies that: over 0.4 s.
    EXPECT_LT((environment.state.positions - expected_end).cwiseAbs().maxCoeff(),
              0.5 * 1e-3 * 9.81 * 0.4 * 0.4);
  }
}

TEST(InstructionLevel, ALevelThatTheMachineLacksIsRefused) {
  const std::vector<InstructionLevel> levels = instruction_levels();
  EXPECT_EQ(highest_instruction_level(), levels.back());
  const InstructionLevel other =
      levels.front() == InstructionLevel::generic ? InstructionLevel::v2 : InstructionLevel::generic;
  EXPECT_THROW(kernels_of(other), std::invalid_argument);
}

}  // namespace
}  // namespace flash::sim
