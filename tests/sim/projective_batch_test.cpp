// Batches by the projective method, on the processor and on the device.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "data/files/error.h"
#include "sim/batch.h"
#include "sim/device_limits.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using data::Points;
using Eigen::Vector3d;

#define SKIP_WITHOUT_DEVICE() \
  if (const std::string why = why_no_cuda(); !why.empty()) GTEST_SKIP() << why

constexpr int steps = 30;
constexpr double side = 0.16;

std::shared_ptr<const SheetPlan> sheet(int cells = 8) { return make_sheet_plan(small_sheet(cells, side)); }

/// The published budget: five local-global iterations, none fewer, up to ten of contact.
BatchSettings settings_on(Device device) {
  BatchSettings settings;
  settings.projective.emplace();
  settings.projective->iterations = 5;
  settings.projective->tolerance = 1e-15;
  settings.projective->acceleration = 0;
  settings.projective->metric = ContactMetric::inertia;
  settings.projective->constraints.iterations = 10;
  settings.projective->constraints.tolerance = 1e-9;
  settings.steps = steps;
  settings.kept_steps = {0, 5, 17, steps};
  settings.threads = 2;
  settings.device = device;
  return settings;
}

Environment soft(const SheetPlan& plan) {
  Environment environment = environment_of(plan.sheet);
  environment.materials[0].membrane_stiffness = 60;
  environment.materials[0].bending_rigidity = 5e-5;
  environment.materials[0].areal_density = 0.2;
  environment.materials[0].friction = 0.3;
  environment.materials[0].bending_model = data::BendingModel::isometric;
  return environment;
}

Environment hanging(const SheetPlan& plan) {
  Environment environment = soft(plan);
  environment.holds = {{.vertices = {0, 1, 9}}};
  return environment;
}

/// All environments of a batch have as many holds: one that never closes.
Environment free_of(Environment environment) {
  environment.holds = {{.vertices = {0}, .from = 1e3}};
  return environment;
}

Environment on_a_plane(const SheetPlan& plan) {
  Environment environment = soft(plan);
  environment.obstacles = {{Plane{}}};
  environment.state.positions.col(2).array() += 2e-3;
  environment.state.velocities.rowwise() = Eigen::RowVector3d(0.3, 0.1, 0);
  return free_of(environment);
}

/// A grasp that closes and opens again.
Environment grasped(const SheetPlan& plan) {
  Environment environment = soft(plan);
  environment.obstacles = {{Plane{}}};
  Hold grasp = gripped(environment, {0, 1, 9}, straight_path({0, 0, -0.01}, {0.02, 0.02, 0.06}, 0.3));
  grasp.from = 0.05;
  grasp.to = 0.2;
  grasp.closing_time = 0.03;
  environment.holds = {grasp};
  return environment;
}

Environment damped(const SheetPlan& plan, data::BendingModel bending, data::Constitutive constitutive) {
  Environment environment = on_a_plane(plan);
  data::SheetMaterial& material = environment.materials[0];
  material.stiffness_damping = 1e-3;
  material.air_drag = 0.5;
  material.bending_model = bending;
  material.constitutive = constitutive;
  environment.loads = {{40, {0, 0, 0.02}}};
  return environment;
}

/// Slides down a plane onto a cylinder: vertices meet both.
Environment in_a_corner(const SheetPlan& plan) {
  Environment environment = on_a_plane(plan);
  environment.obstacles.push_back({Cylinder{Vector3d(0.2, 0, 0.02), Vector3d::UnitY(), 0.02}});
  return environment;
}

Batch run(const std::shared_ptr<const SheetPlan>& plan, const std::vector<Environment>& environments,
          const BatchSettings& settings) {
  Batch batch(plan, environments, settings);
  batch.advance(settings.steps - settings.first_step);
  return batch;
}

/// The largest distance between the first kept positions [m].
double distance(const Batch& a, const Batch& b, int e, int kept = 4) {
  double largest = 0;
  for (int k = 0; k < kept; ++k)
    largest =
        std::max(largest, (a.kept_positions(e, k) - b.kept_positions(e, k)).rowwise().norm().maxCoeff());
  return largest;
}

/// The error of a solve, as a share of what it gives: its factor's numbers are rounded to `bits`, and errors
/// of a row's hundreds of numbers add up as a walk at random.
double solve_error(const SheetPlan& plan, int bits) {
  return std::sqrt(static_cast<double>(plan.pattern.size)) * std::exp2(-bits);
}

/// What an iteration is off by, as a share of its way. Contacts are met to a thousandth of it.
double iteration_error(const SheetPlan& plan, const Environment& environment, int bits) {
  return solve_error(plan, bits) + (environment.obstacles.empty() ? 0 : 1e-3);
}

/// How far the solves of one step move vertices, added up: from where speeds take them to the first iterate,
/// by a fall that contacts hold up anew in each step, and by each iteration, from budgets of none to all.
class Ways {
 public:
  explicit Ways(const std::shared_ptr<const SheetPlan>& plan) {
    ProjectiveSettings settings = *settings_on(Device::cpu).projective;
    const int all = settings.iterations;
    for (settings.iterations = 0; settings.iterations <= all; ++settings.iterations)
      solvers_.emplace_back(plan, settings);
  }
  double of_next_step(const Environment& environment) {
    const double h = settings_on(Device::cpu).projective->time_step;
    double sum = h * h * environment.gravity.norm();
    Points before = environment.state.positions + h * environment.state.velocities;
    for (ProjectiveSolver& solver : solvers_) {
      Environment own = environment;
      solver.step(own);
      sum += (own.state.positions - before).rowwise().norm().maxCoeff();
      before = own.state.positions;
    }
    return sum;
  }

 private:
  std::vector<ProjectiveSolver> solvers_;
};

/// How far apart two runs may be.
struct Allowed {
  std::vector<double> distances;  ///< at each kept step [m]
  double residual = 0;            ///< of all steps
};

/// By as much as the processor's own run is off, where each step ends off by `error` times the ways of its
/// iterations. Such errors along all ways, against them and anywhere show how it amplifies them.
Allowed allowed_by(const std::shared_ptr<const SheetPlan>& plan, const Environment& environment,
                   double error) {
  constexpr double beyond_drawn = 2;  // of a worse direction than those that are tried
  enum { exact, along, against, anywhere, runs };
  const BatchSettings settings = settings_on(Device::cpu);
  const double h = settings.projective->time_step;
  Ways ways(plan);
  std::vector<double> steps_off;
  std::vector<Points> expected;
  std::vector<double> residuals;
  Allowed allowed;
  allowed.distances.assign(settings.kept_steps.size(), 0);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int run = exact; run < runs; ++run) {
    Environment own = environment;
    ProjectiveSolver solver(plan, *settings.projective);
    std::size_t kept = 1;
    for (int k = 0; k < steps; ++k) {
      if (run == exact) steps_off.push_back(error * ways.of_next_step(own));
      const Points predicted = own.state.positions + h * own.state.velocities;
      const double residual = solver.step(own).residual;
      if (run == exact)
        residuals.push_back(residual);
      else
        allowed.residual = std::max(
            allowed.residual, beyond_drawn * std::abs(residual - residuals[static_cast<std::size_t>(k)]));
      if (run != exact) {
        Points off = own.state.positions - predicted;
        if (run == against) off = -off;
        if (run == anywhere) off = off.unaryExpr([&](double) { return normal(random); });
        off *= steps_off[static_cast<std::size_t>(k)] / std::max(off.rowwise().norm().maxCoeff(), 1e-300);
        own.state.positions += off;
        own.state.velocities += off / h;
      }
      if (settings.kept_steps[kept] != k + 1) continue;
      if (run == exact) {
        expected.push_back(own.state.positions);
      } else {
        const Points apart = own.state.positions - expected[kept - 1];
        double& distance = allowed.distances[kept];
        distance = std::max(distance, beyond_drawn * apart.rowwise().norm().maxCoeff());
      }
      ++kept;
    }
  }
  return allowed;
}

TEST(ProjectiveBatch, IsThatOfTheSolver) {
  const auto plan = sheet();
  const std::vector<Environment> environments = {hanging(*plan), on_a_plane(*plan), grasped(*plan)};
  for (const Environment& environment : environments) {
    const BatchSettings settings = settings_on(Device::cpu);
    const Batch batch = run(plan, {environment}, settings);
    Environment own = environment;
    ProjectiveSolver solver(plan, *settings.projective);
    for (int k = 0; k < steps; ++k) {
      const ProjectiveReport report = solver.step(own);
      EXPECT_EQ(batch.stats(0)[k].residual, report.residual);
      EXPECT_EQ(batch.stats(0)[k].iterations, report.iterations);
    }
    EXPECT_EQ(batch.state(0).positions, own.state.positions);
  }
}

TEST(ProjectiveBatch, WhatTheDeviceHasNotIsNamed) {
  ProjectiveSettings settings = *settings_on(Device::cuda).projective;
  EXPECT_EQ(why_not_on_device(settings), "");
  settings.metric = ContactMetric::full;
  EXPECT_NE(why_not_on_device(settings).find("inertia metric"), std::string::npos);
  settings = {};
  EXPECT_NE(why_not_on_device(settings).find("acceleration"), std::string::npos);
}

TEST(ProjectiveBatch, OnTheDeviceIsThatOfTheProcessor) {
  SKIP_WITHOUT_DEVICE();
  for (const int cells : {8, 31}) {
    const auto plan = sheet(cells);
    const std::vector<Environment> environments = {
        hanging(*plan),
        on_a_plane(*plan),
        grasped(*plan),
        damped(*plan, data::BendingModel::isometric, data::Constitutive::tri_arap),
        damped(*plan, data::BendingModel::plate, data::Constitutive::tri_stvk),
        damped(*plan, data::BendingModel::hinge, data::Constitutive::tri_corotated)};
    const Batch device = run(plan, environments, settings_on(Device::cuda)),
                cpu = run(plan, environments, settings_on(Device::cpu));
    constexpr int bits = 22;  // of a factor in two parts
    for (int e = 0; e < device.size(); ++e) {
      SCOPED_TRACE(testing::Message() << cells << " cells, environment " << e);
      const Environment& environment = environments[static_cast<std::size_t>(e)];
      const Allowed allowed = allowed_by(plan, environment, iteration_error(*plan, environment, bits));
      for (int k = 0; k < 4; ++k) {
        const Points apart = device.kept_positions(e, k) - cpu.kept_positions(e, k);
        EXPECT_LE(apart.rowwise().norm().maxCoeff(), allowed.distances[static_cast<std::size_t>(k)]) << k;
      }
      const double at_end = *std::max_element(allowed.distances.begin(), allowed.distances.end());
      for (int k = 0; k < steps; ++k) {
        const StepStats &own = device.stats(e)[k], &expected = cpu.stats(e)[k];
        EXPECT_EQ(own.iterations, expected.iterations) << k;
        EXPECT_EQ(own.converged, expected.converged) << k;
        EXPECT_NEAR(own.penetration_max, expected.penetration_max, at_end) << k;
        // Of forces of the membrane: E t times what places differ by over an edge, beside the weight; errors
        // have not grown at first.
        EXPECT_NEAR(own.residual, expected.residual,
                    k < 5 ? 1e-2 * expected.residual + 1e-3 : allowed.residual)
            << k;
      }
      const std::ptrdiff_t first = e * steps * 3;
      for (std::ptrdiff_t k = first; k < first + 17 * 3; ++k)
        EXPECT_NEAR(device.hold_forces().data[k], cpu.hold_forces().data[k],
                    1e-3 + 1e-2 * std::abs(cpu.hold_forces().data[k]));
      // Of two places, one step apart.
      EXPECT_LE((device.state(e).velocities - cpu.state(e).velocities).cwiseAbs().maxCoeff(),
                2 * at_end / 0.01);
    }
  }
}

TEST(ProjectiveBatch, AHalfFactorIsAsFarOffAsItsNumbers) {
  SKIP_WITHOUT_DEVICE();
  const auto plan = sheet(20);
  const std::vector<Environment> environments = {hanging(*plan), on_a_plane(*plan), grasped(*plan)};
  BatchSettings settings = settings_on(Device::cuda);
  settings.steps = 1;
  settings.kept_steps = {};
  const Batch exact = run(plan, environments, settings);
  settings.half_factor = true;
  const Batch half = run(plan, environments, settings);
  for (int e = 0; e < half.size(); ++e) {
    const Environment& environment = environments[static_cast<std::size_t>(e)];
    const double apart = (half.state(e).positions - exact.state(e).positions).rowwise().norm().maxCoeff();
    EXPECT_LE(apart, iteration_error(*plan, environment, 11) * Ways(plan).of_next_step(environment));
  }
}

TEST(ProjectiveBatch, VerticesThatMeetTwoObstaclesObeyBoth) {
  SKIP_WITHOUT_DEVICE();
  const auto plan = sheet();
  const std::vector<Environment> environments = {in_a_corner(*plan)};
  const Batch device = run(plan, environments, settings_on(Device::cuda)),
              cpu = run(plan, environments, settings_on(Device::cpu));
  // The processor solves vertices with two contacts to 1e-3 in each of its Newton steps.
  EXPECT_LE(distance(device, cpu, 0), 1e-3 * side);
}

TEST(ProjectiveBatch, OnTheDeviceEqualsItsEnvironmentsAloneBitForBit) {
  SKIP_WITHOUT_DEVICE();
  const auto plan = sheet(20);
  std::vector<Environment> environments;
  for (int e = 0; e < 200; ++e) {
    environments.push_back(e % 2 == 0 ? grasped(*plan) : on_a_plane(*plan));
    environments.back().materials[0].membrane_stiffness = 20 + e;
  }
  BatchSettings settings = settings_on(Device::cuda);
  settings.half_factor = true;
  const Batch together = run(plan, environments, settings);
  for (const int e : {0, 1, 131, 132, 199}) {
    const Batch alone = run(plan, {environments[static_cast<std::size_t>(e)]}, settings);
    EXPECT_EQ(together.state(e).positions, alone.state(0).positions);
    EXPECT_EQ(together.state(e).velocities, alone.state(0).velocities);
  }
}

}  // namespace
}  // namespace flash::sim
