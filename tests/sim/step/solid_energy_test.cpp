#include "sim/step/solid_energy.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <random>

#include "sim/step/incremental_potential.h"
#include "sim/step/solid_damping.h"
#include "tests/sim/solid_scene.h"

namespace flash::sim {
namespace {

using data::Constitutive;
using data::Points;
using Eigen::Vector3d;

Points noise(Eigen::Index rows, double size, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> draw(-size, size);
  Points points(rows, 3);
  for (Eigen::Index i = 0; i < points.size(); ++i) points.data()[i] = draw(generator);
  return points;
}

Sheet box() { return solid_box({0.1, 0.06, 0.04}, {3, 2, 1}); }

/// A strained solid on its way, damped.
Environment moving_environment(const Sheet& sheet, Constitutive model) {
  Environment environment = solid_environment(sheet, {.constitutive = model,
                                                      .youngs_modulus = 2e4,
                                                      .density = 300,
                                                      .air_drag = 2,
                                                      .stiffness_damping = 0.02});
  environment.state.positions = 1.05 * sheet.rest.vertices + noise(sheet.rest.vertices.rows(), 3e-3, 1);
  environment.state.velocities = noise(sheet.rest.vertices.rows(), 0.3, 2);
  environment.loads.push_back({3, {0.1, -0.2, 0.3}});
  return environment;
}

/// The matrix of blocks in full.
Eigen::MatrixXd full(const BlockPattern& pattern, const BlockValues<double>& values) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(3L * pattern.size, 3L * pattern.size);
  const auto block = [&](std::size_t k) { return Eigen::Map<const Eigen::Matrix3d>(values.data() + 9 * k); };
  for (int i = 0; i < pattern.size; ++i) matrix.block<3, 3>(3L * i, 3L * i) = block(i);
  for (std::size_t k = 0; k < pattern.pairs.size(); ++k) {
    const auto [row, column] = pattern.pairs[k];
    matrix.block<3, 3>(3L * row, 3L * column) = block(pattern.size + k);
    matrix.block<3, 3>(3L * column, 3L * row) = block(pattern.size + k).transpose();
  }
  return matrix;
}

constexpr Constitutive models[] = {Constitutive::tet_arap, Constitutive::tet_corotated,
                                   Constitutive::tet_neohookean, Constitutive::tet_neohookean_log};

// With inertia, drag, loads and damping; step^2 of truncation stands against 1e-16 / step of rounding.
TEST(SolidEnergy, ForceAndMatrixAreTheDerivativesOfThePotential) {
  const Sheet sheet = box();
  const auto plan = make_sheet_plan(sheet);
  const double step = 1e-6;
  for (const Constitutive model : models) {
    const Environment environment = moving_environment(sheet, model);
    const std::vector<BodyLaw> laws = body_laws(*plan, environment);
    const IncrementalPotential potential(*plan, laws, environment, 0.01);
    const Points x = environment.state.positions + noise(sheet.rest.vertices.rows(), 2e-3, 3);
    ElasticEnergy elastic;
    BlockValues<double> values;
    potential.assemble(x, Curvature::exact, true, values);
    const Eigen::MatrixXd matrix = full(plan->pattern, values);
    for (unsigned seed = 4; seed < 8; ++seed) {
      const Points along = noise(x.rows(), 1, seed);
      Points force, after, before;
      potential.evaluate(x, force, elastic);
      const double rise = potential.evaluate(x + step * along, after, elastic) -
                          potential.evaluate(x - step * along, before, elastic);
      EXPECT_NEAR(force.cwiseProduct(along).sum(), rise / (2 * step), 1e-6 * std::abs(rise / (2 * step)));
      const Points change = (after - before) / (2 * step);
      const Eigen::VectorXd expected = Eigen::Map<const Eigen::VectorXd>(change.data(), change.size()),
                            found = matrix * Eigen::Map<const Eigen::VectorXd>(along.data(), along.size());
      EXPECT_LT((found - expected).norm(), 1e-7 * expected.norm());
    }
    potential.assemble(x, Curvature::positive, true, values);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(full(plan->pattern, values)).eigenvalues()[0],
              0);
  }
}

TEST(SolidEnergy, ASolidThatTurnsIsNotDamped) {
  const Sheet sheet = box();
  const auto plan = make_sheet_plan(sheet);
  const Points start = sheet.rest.vertices + noise(sheet.rest.vertices.rows(), 3e-3, 1);
  const Eigen::Matrix3d turn(Eigen::AngleAxisd(0.7, Vector3d(1, 2, -1).normalized()));
  Points gradient = Points::Zero(start.rows(), 3);
  const double potential = add_solid_damping_gradient(
      *plan, sheet.bodies[0], solid_metrics(*plan, start), {1e4, 2e4},
      (start * turn.transpose()).rowwise() + Eigen::RowVector3d(0.1, -0.3, 0.2), gradient);
  // Strains are of rounding, 1e-15, and its square.
  EXPECT_LT(potential, 1e-24);
  EXPECT_LT(gradient.norm(), 1e-13 * 1e4 * 0.1);
}

TEST(SolidEnergy, ForcesAndTorquesOfASolidOnItselfVanish) {
  const Sheet sheet = box();
  const auto plan = make_sheet_plan(sheet);
  const Points x = sheet.rest.vertices + noise(sheet.rest.vertices.rows(), 5e-3, 1);
  for (const Constitutive model : models) {
    Points gradient = Points::Zero(x.rows(), 3);
    add_solid_gradient(*plan, sheet.bodies[0], solid_of({.constitutive = model}), x, gradient);
    Vector3d torque = Vector3d::Zero();
    for (Eigen::Index i = 0; i < x.rows(); ++i) torque += Vector3d(x.row(i)).cross(Vector3d(gradient.row(i)));
    EXPECT_LT(gradient.colwise().sum().norm(), 1e-13 * gradient.norm());
    EXPECT_LT(torque.norm(), 1e-13 * gradient.norm());
  }
}

}  // namespace
}  // namespace flash::sim
