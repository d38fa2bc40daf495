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
using data::ElementOrder;
using data::Points;
using Eigen::Vector3d;

Points noise(Eigen::Index rows, double size, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> draw(-size, size);
  Points points(rows, 3);
  for (Eigen::Index i = 0; i < points.size(); ++i) points.data()[i] = draw(generator);
  return points;
}

Sheet box(ElementOrder order) {
  return order == ElementOrder::linear ? solid_box({0.1, 0.06, 0.04}, {3, 2, 1})
                                       : solid_box({0.1, 0.06, 0.04}, {2, 1, 1}, order);
}

constexpr ElementOrder orders[] = {ElementOrder::linear, ElementOrder::quadratic};

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
void expect_derivatives(const Sheet& sheet, Constitutive model) {
  const auto plan = make_sheet_plan(sheet);
  const double step = 1e-6;
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
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(full(plan->pattern, values)).eigenvalues()[0], 0);
}

TEST(SolidEnergy, ForceAndMatrixAreTheDerivativesOfThePotential) {
  for (const ElementOrder order : orders)
    for (const Constitutive model : models) expect_derivatives(box(order), model);
}

// u = kappa (-x z, 0, x^2 / 2) has the strain -kappa z along x alone: for nu = 0 the energy of a bent bar,
// E I kappa^2 / 2 for each metre. Quadratic elements have this field, and their rule sums it exactly up to
// terms of the fourth order in kappa.
TEST(SolidEnergy, QuadraticTetrahedraBendAsABar) {
  const double length = 0.1, width = 0.06, height = 0.04, kappa = 1e-4, youngs_modulus = 2e4;
  const Sheet sheet = solid_box({length, width, height}, {2, 1, 1}, ElementOrder::quadratic);
  const auto plan = make_sheet_plan(sheet);
  Points x = sheet.rest.vertices;
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const double along = x(i, 0), up = x(i, 2) - height / 2;
    x(i, 0) -= kappa * along * up;
    x(i, 2) += 0.5 * kappa * along * along;
  }
  const double inertia = width * height * height * height / 12;
  const double expected = 0.5 * youngs_modulus * inertia * kappa * kappa * length;
  for (const Constitutive model : models) {
    Points gradient = Points::Zero(x.rows(), 3);
    const double energy = add_solid_gradient(
        *plan, sheet.bodies[0],
        solid_of({.constitutive = model, .youngs_modulus = youngs_modulus, .poissons_ratio = 0}), x,
        gradient);
    // Cubic terms of the laws: strains of kappa height / 2 = 2e-6, turns of kappa length = 1e-5.
    EXPECT_NEAR(energy, expected, 1e-4 * expected);
  }
}

// A patch: under a homogeneous strain no vertex within feels a force, whatever the mesh.
TEST(SolidEnergy, AHomogeneousStrainBalancesWithin) {
  Eigen::Matrix3d F;
  F << 1.2, 0.1, 0, -0.2, 0.9, 0.05, 0.1, 0, 1.1;
  for (const ElementOrder order : orders) {
    const Sheet sheet = solid_box({0.1, 0.06, 0.04}, {4, 3, 2}, order);
    const auto plan = make_sheet_plan(sheet);
    for (const Constitutive model : models) {
      Points gradient = Points::Zero(sheet.rest.vertices.rows(), 3);
      add_solid_gradient(*plan, sheet.bodies[0], solid_of({.constitutive = model}),
                         sheet.rest.vertices * F.transpose(), gradient);
      for (Eigen::Index i = 0; i < gradient.rows(); ++i)
        if (sheet.vertex_area[i] == 0) {
          EXPECT_LT(gradient.row(i).norm(), 1e-13 * gradient.norm());
        }
    }
  }
}

TEST(SolidEnergy, ASolidThatTurnsIsNotDamped) {
  for (const ElementOrder order : orders) {
    const Sheet sheet = box(order);
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
}

TEST(SolidEnergy, ForcesAndTorquesOfASolidOnItselfVanish) {
  for (const ElementOrder order : orders) {
    const Sheet sheet = box(order);
    const auto plan = make_sheet_plan(sheet);
    const Points x = sheet.rest.vertices + noise(sheet.rest.vertices.rows(), 5e-3, 1);
    for (const Constitutive model : models) {
      Points gradient = Points::Zero(x.rows(), 3);
      add_solid_gradient(*plan, sheet.bodies[0], solid_of({.constitutive = model}), x, gradient);
      Vector3d torque = Vector3d::Zero();
      for (Eigen::Index i = 0; i < x.rows(); ++i)
        torque += Vector3d(x.row(i)).cross(Vector3d(gradient.row(i)));
      EXPECT_LT(gradient.colwise().sum().norm(), 1e-13 * gradient.norm());
      EXPECT_LT(torque.norm(), 1e-13 * gradient.norm());
    }
  }
}

}  // namespace
}  // namespace flash::sim
