#include "sim/step/springs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "sim/step/contact_set.h"
#include "sim/step/incremental_potential.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using data::Points;
using Eigen::Vector3d;

constexpr double h = 0.01, rigid = std::numeric_limits<double>::infinity();

Points noise(Eigen::Index rows, double size, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> draw(-size, size);
  Points points(rows, 3);
  for (Eigen::Index i = 0; i < points.size(); ++i) points.data()[i] = draw(generator);
  return points;
}

/// A crumpled sheet on its way. One moving hold has springs of all kinds, a second one shares a vertex with
/// it, a third carries the height of another.
Environment sprung_environment(const Sheet& sheet) {
  Environment environment = environment_of(sheet);
  environment.state.positions += noise(sheet.rest.vertices.rows(), 3e-3, 1);
  environment.state.velocities = noise(sheet.rest.vertices.rows(), 0.3, 2);
  Hold pads = gripped(environment, {0, 1, 2, 7, 8}, straight_path(Vector3d::Zero(), {0.01, 0.02, 0.05}, 0.1));
  pads.stiffness = Eigen::Matrix<double, 5, 1>{10, 300, 0, rigid, 50};
  Hold second{.vertices = {1}, .targets = Eigen::RowVector3d(0.03, 0.01, 0.02)};
  second.stiffness = Eigen::VectorXd::Constant(1, 70);
  environment.holds = {pads, second, support(8, {false, false, true}, {0, 0, 0.01})};
  update_holds(environment, h);
  return environment;
}

TEST(Springs, AreThoseOfSoftVerticesAlongAxesThatNothingCarries) {
  const Sheet sheet = small_sheet();
  const Environment environment = sprung_environment(sheet);
  const std::vector<Spring> springs = springs_of(environment, h);
  std::vector<int> vertices;
  for (const Spring& spring : springs) vertices.push_back(spring.vertex);
  EXPECT_EQ(vertices, (std::vector{0, 1, 2, 8, 1}));
  EXPECT_EQ(springs[3].entry, 4);
  EXPECT_EQ(springs[4].hold, 1);
  for (const Spring& spring : springs)
    EXPECT_EQ(spring.acts.z(), spring.vertex == 8 ? 0 : 1) << spring.vertex;
  const Vector3d start = environment.state.positions.row(0);
  EXPECT_LE((springs[0].before - start).norm(), 1e-15);
  EXPECT_LE((springs[0].place - start - 0.1 * Vector3d(0.01, 0.02, 0.05)).norm(), 1e-15);

  Points positions = environment.state.positions;
  const ContactSet held = begin_step(ContactStep(sheet, environment, h, {}), positions);
  ASSERT_EQ(held.held, 2u);
  EXPECT_EQ(held.constraints[0].vertex, 7);
  EXPECT_EQ(held.constraints[1].vertex, 8);
}

TEST(Springs, ForceAndStiffnessAreDerivativesOfThePotential) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  Environment environment = sprung_environment(sheet);
  environment.materials[0] = {.bending_model = data::BendingModel::hinge, .membrane_stiffness = 200};
  const std::vector<BodyLaw> laws = body_laws(*plan, environment);
  const IncrementalPotential potential(*plan, laws, environment, h);
  const Points x = environment.state.positions + noise(sheet.rest.vertices.rows(), 2e-3, 3);
  Points along = Points::Zero(x.rows(), 3), force, above, below;
  for (const Spring& spring : potential.springs())
    along.row(spring.vertex) = noise(1, 1, static_cast<unsigned>(spring.vertex)).row(0);
  ElasticEnergy elastic;
  potential.evaluate(x, force, elastic);
  const double step = 1e-6;  // step^2 truncation against 1e-16 / step rounding
  const double slope = (potential.evaluate(x + step * along, above, elastic) -
                        potential.evaluate(x - step * along, below, elastic)) /
                       (2 * step);
  EXPECT_NEAR(force.cwiseProduct(along).sum(), slope, 1e-6 * std::abs(slope));

  // What springs add to the Hessian, by its difference from that without them.
  Environment without = environment;
  without.holds.clear();
  without.state.held.clear();
  const std::vector<BodyLaw> free_laws = body_laws(*plan, without);
  const IncrementalPotential free(*plan, free_laws, without, h);
  BlockValues<double> values, free_values;
  potential.assemble(x, Curvature::exact, false, values);
  free.assemble(x, Curvature::exact, false, free_values);
  Points free_above, free_below;
  free.evaluate(x + step * along, free_above, elastic);
  free.evaluate(x - step * along, free_below, elastic);
  const Points change = (above - below - free_above + free_below) / (2 * step);
  double largest = 0;
  for (int i = 0; i < x.rows(); ++i)
    for (int c = 0; c < 3; ++c) {
      const double added = values[9L * i + 4 * c] - free_values[9L * i + 4 * c];
      EXPECT_NEAR(change(i, c), added * along(i, c), 1e-6) << i;  // of 1e4 N/m that cancel
      largest = std::max(largest, added);
    }
  EXPECT_NEAR(largest, 370, 1e-9);  // two springs on a vertex add up
}

TEST(Springs, ThePotentialAtTheStartIsThatOfEvaluate) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  const Environment environment = sprung_environment(sheet);
  const std::vector<BodyLaw> laws = body_laws(*plan, environment);
  const IncrementalPotential potential(*plan, laws, environment, h);
  Points force;
  ElasticEnergy elastic;
  const double value = potential.evaluate(environment.state.positions, force, elastic);
  EXPECT_NEAR(potential.at_start(elastic), value, 1e-14 * value);
}

TEST(Springs, PullTakesALoneVertexToItsBalance) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  const Environment environment = sprung_environment(sheet);
  const std::vector<BodyLaw> laws = body_laws(*plan, environment);
  const IncrementalPotential potential(*plan, laws, environment, h);
  const Points& start = environment.state.positions;
  Points free = start + h * environment.state.velocities, pulled = free;
  potential.pull(1, pulled);
  // Forces of inertia and of two springs, which begin without a pull, cancel on vertex 1.
  Vector3d left = potential.mass()[1] / (h * h) * (pulled.row(1) - free.row(1));
  for (const Spring& spring : potential.springs())
    if (spring.vertex == 1)
      left += spring.stiffness *
              (Vector3d(pulled.row(1)) - Vector3d(start.row(1)) - (spring.place - spring.before));
  EXPECT_LE(left.norm(), 1e-12);
  EXPECT_EQ(pulled.row(20), free.row(20));
  EXPECT_EQ(pulled.row(2), free.row(2));  // a spring of no stiffness
}

}  // namespace
}  // namespace flash::sim
