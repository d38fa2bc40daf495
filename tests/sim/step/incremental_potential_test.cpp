#include "sim/step/incremental_potential.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using data::BendingModel;
using data::Points;
using Eigen::Vector3d;

constexpr BendingModel bendings[] = {BendingModel::plate, BendingModel::isometric, BendingModel::hinge};

Points noise(Eigen::Index rows, double size, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> draw(-size, size);
  Points points(rows, 3);
  for (Eigen::Index i = 0; i < points.size(); ++i) points.data()[i] = draw(generator);
  return points;
}

/// A crumpled, stretched sheet on its way, damped.
Environment moving_environment(const Sheet& sheet, BendingModel model) {
  Environment environment = environment_of(sheet);
  environment.materials[0] = {.bending_model = model,
                              .membrane_stiffness = 200,
                              .bending_rigidity = 1e-3,
                              .air_drag = 2,
                              .stiffness_damping = 0.05};
  environment.state.positions = 1.05 * sheet.rest.vertices + noise(sheet.rest.vertices.rows(), 3e-3, 1);
  environment.state.velocities = noise(sheet.rest.vertices.rows(), 0.3, 2);
  environment.loads.push_back({3, {0.1, -0.2, 0.3}});
  return environment;
}

TEST(IncrementalPotential, TheForceIsItsGradient) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  for (const BendingModel model : bendings) {
    const Environment environment = moving_environment(sheet, model);
    const std::vector<BodyLaw> laws = body_laws(*plan, environment);
    const IncrementalPotential potential(*plan, laws, environment, 0.01);
    const Points x = environment.state.positions + noise(sheet.rest.vertices.rows(), 2e-3, 3),
                 along = noise(x.rows(), 1, 4);
    Points force, unused;
    ElasticEnergy elastic;
    potential.evaluate(x, force, elastic);
    const double step = 1e-6;  // step^2 truncation against 1e-16 / step rounding
    const double slope = (potential.evaluate(x + step * along, unused, elastic) -
                          potential.evaluate(x - step * along, unused, elastic)) /
                         (2 * step);
    EXPECT_NEAR(force.cwiseProduct(along).sum(), slope, 1e-6 * std::abs(slope)) << int(model);
  }
}

TEST(IncrementalPotential, DampingPutsNoTorqueAndNoForceOnAStressedSheetThatTurns) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.4, Vector3d(1, -2, 3).normalized()).matrix();
  for (const BendingModel model : bendings) {
    Environment environment = moving_environment(sheet, model), undamped = environment;
    undamped.materials[0].stiffness_damping = 0;
    const std::vector<BodyLaw> laws = body_laws(*plan, environment),
                               undamped_laws = body_laws(*plan, undamped);
    const IncrementalPotential damped_potential(*plan, laws, environment, 0.01),
        undamped_potential(*plan, undamped_laws, undamped, 0.01);
    const auto damping_at = [&](const Points& x) {
      Points with, without;
      ElasticEnergy elastic;
      damped_potential.evaluate(x, with, elastic);
      undamped_potential.evaluate(x, without, elastic);
      return Points(with - without);
    };
    const Points& start = environment.state.positions;
    const Points turned = (start * turn.transpose()).rowwise() + Eigen::RowVector3d(0.1, 0.2, -0.3);
    const Points moved = turned + noise(start.rows(), 2e-3, 5);
    const double scale = damping_at(moved).norm();
    // 1e-16 of the terms that cancel: E t b / h times a strain of 1, and D b / h over a cell squared.
    EXPECT_LT(damping_at(turned).norm(), 1e-8 * scale) << int(model);
    // Any other motion: internal forces, without a resultant and without a torque.
    const Points force = damping_at(moved);
    Vector3d torque = Vector3d::Zero();
    for (Eigen::Index i = 0; i < force.rows(); ++i)
      torque += Vector3d(moved.row(i)).cross(Vector3d(force.row(i)));
    EXPECT_LT(force.colwise().sum().norm(), 1e-9 * scale) << int(model);
    EXPECT_LT(torque.norm(), 1e-9 * scale) << int(model);
  }
}

/// A cantilever of 0.2 m, clamped over its first cells, in its first mode: its decay by damping is b w^2 / 2.
class RingDown : public testing::TestWithParam<std::tuple<BendingModel, data::DiagonalPattern>> {};

struct Swing {
  double frequency, decay;  ///< [rad/s], [1/s]
};

/// From the crossings and peaks of the first mode's share in the motion, once higher modes have died.
Swing swing_of(const Sheet& sheet, BendingModel model, double damping) {
  constexpr double time_step = 1e-3, clamped = 0.0068;
  Environment environment = environment_of(sheet);
  environment.gravity.setZero();
  environment.materials[0] = {.bending_model = model,
                              .membrane_stiffness = 1e4,
                              .poissons_ratio = 0,
                              .areal_density = 0.1,
                              .bending_rigidity = 1e-3,
                              .stiffness_damping = damping};
  Eigen::VectorXd mode = Eigen::VectorXd::Zero(sheet.rest.vertices.rows());
  for (int i = 0; i < mode.size(); ++i) {
    const double x = sheet.rest.vertices(i, 0);
    if (x <= clamped) {
      environment.holds.push_back(support(i, {true, true, true}, sheet.rest.vertices.row(i).transpose()));
      continue;
    }
    const double s = 1.8751 * (x - clamped) / (0.2 - clamped);
    mode[i] = std::cosh(s) - std::cos(s) - 0.7341 * (std::sinh(s) - std::sin(s));
  }
  environment.state.positions.col(2) = 1e-4 * mode;  // 0.2 mm at the tip: linear
  Solver solver(sheet, {.time_step = time_step, .tolerance = 1e-6});
  std::vector<double> crossings, peaks;
  double before = 1, peak = 0;
  while (crossings.size() < 12) {
    EXPECT_TRUE(solver.step(environment).converged);
    const double now = environment.state.positions.col(2).dot(sheet.vertex_area.cwiseProduct(mode));
    peak = std::max(peak, std::abs(now));
    if ((now > 0) != (before > 0)) {
      crossings.push_back(environment.state.time - time_step * now / (now - before));
      peaks.push_back(peak);
      peak = 0;
    }
    before = now;
  }
  const size_t first = 4;
  const double half_period = (crossings.back() - crossings[first]) / double(crossings.size() - 1 - first);
  return {M_PI / half_period,
          std::log(peaks[first + 1] / peaks.back()) / (half_period * double(peaks.size() - 2 - first))};
}

TEST_P(RingDown, DecaysByHalfTheDampingTimesItsFrequencySquared) {
  const auto [model, pattern] = GetParam();
  const Sheet sheet = make_sheet(
      data::rectangle({.width = 0.2, .height = 0.02, .cells_x = 30, .cells_y = 3, .pattern = pattern}));
  const Swing undamped = swing_of(sheet, model, 0);
  const double damping = 0.02 / undamped.frequency;
  const double decay = swing_of(sheet, model, damping).decay - undamped.decay;
  const double expected = 0.5 * damping * undamped.frequency * undamped.frequency;
  EXPECT_NEAR(decay, expected, 0.02 * expected);
}

INSTANTIATE_TEST_SUITE_P(Models, RingDown,
                         testing::Combine(testing::ValuesIn(bendings),
                                          testing::Values(data::DiagonalPattern::alternating_by_row,
                                                          data::DiagonalPattern::jittered)));

}  // namespace
}  // namespace flash::sim
