// Batches on the device beside those on the processor.
#include "sim/batch.h"
#include "sim/device_limits.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>

#include "data/files/error.h"
#include "tests/data/temporary_folder.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using data::Points;

#define SKIP_WITHOUT_DEVICE() \
  if (const std::string why = why_no_cuda(); !why.empty()) GTEST_SKIP() << why

constexpr int steps = 30;

std::shared_ptr<const SheetPlan> sheet() { return make_sheet_plan(small_sheet(8, 0.16)); }

/// A lift from a table by a grasp that closes in the middle of the motion, and a hold that opens.
Environment lift(const SheetPlan& plan, int which) {
  Environment environment = environment_of(plan.sheet);
  environment.materials[0].membrane_stiffness = 40.0 + 10 * which;
  environment.materials[0].bending_rigidity = 5e-5;
  environment.materials[0].areal_density = 0.2;
  environment.materials[0].friction = 0.3;
  if (which % 3 == 1) environment.materials[0].poissons_ratio = 0.1;
  if (which % 3 == 2) environment.materials[0].bending_model = data::BendingModel::hinge;
  environment.obstacles = {{Plane{}}};
  Hold grasp = gripped(environment, {0, 1, 9}, straight_path({0, 0, -0.01}, {0.02, 0.02, 0.06}, 0.3));
  grasp.from = which % 2 == 0 ? 0.05 : 0.08;
  grasp.closing_time = 0.03;
  Hold corner{.vertices = {80}};
  corner.to = 0.15;
  environment.holds = {grasp, corner};
  return environment;
}

std::vector<Environment> lifts(const SheetPlan& plan, int count) {
  std::vector<Environment> all;
  for (int e = 0; e < count; ++e) all.push_back(lift(plan, e));
  return all;
}

/// The same lift by pads: springs of other stiffness in each environment, one of them rigid and one without
/// force. The corner is let go from springs, which share a vertex with others.
Environment soft_lift(const SheetPlan& plan, int which) {
  Environment environment = lift(plan, which);
  Hold& grasp = environment.holds[0];
  grasp.vertices = {0, 1, 2, 9, 10};
  grasp.stiffness = std::pow(10.0, which % 4) * Eigen::Matrix<double, 5, 1>{20, 10, 0, 40, 5};
  if (which % 2 == 0) grasp.stiffness[1] = std::numeric_limits<double>::infinity();
  Hold& corner = environment.holds[1];
  corner.vertices = {80, 79, 71};
  corner.stiffness = Eigen::Vector3d(30, 30, 60);
  Hold edge{.vertices = {80, 72}, .axes = {false, false, true}};
  edge.targets = data::Points::Zero(2, 3);
  for (int v = 0; v < 2; ++v) edge.targets.row(v) = plan.sheet.rest.vertices.row(edge.vertices[v]);
  edge.to = 0.1;
  Hold second = corner;
  second.stiffness *= 0.5;
  environment.holds.push_back(edge);
  environment.holds.push_back(second);
  if (which % 3 == 0) environment.obstacles.clear();
  if (which % 4 == 3) environment.materials[0].stiffness_damping = 0.02;
  return environment;
}

std::vector<Environment> soft_lifts(const SheetPlan& plan, int count) {
  std::vector<Environment> all;
  for (int e = 0; e < count; ++e) all.push_back(soft_lift(plan, e));
  return all;
}

BatchSettings settings_on(Device device) {
  BatchSettings settings;
  settings.steps = steps;
  settings.kept_steps = {0, 4, 5, 17, steps};
  settings.solver.stale_factor_solves = 0;
  settings.solver.tolerance = 1e-5;
  settings.threads = 2;
  settings.device = device;
  return settings;
}

Batch run(const std::shared_ptr<const SheetPlan>& plan, const std::vector<Environment>& environments,
          const BatchSettings& settings) {
  Batch batch(plan, environments, settings);
  batch.advance(settings.steps - settings.first_step);
  return batch;
}

/// Simulates them on both. At least so many have to be comparable.
void expect_as_on_the_processor(const std::shared_ptr<const SheetPlan>& plan,
                                const std::vector<Environment>& environments, int least) {
  const Batch device = run(plan, environments, settings_on(Device::cuda)),
              cpu = run(plan, environments, settings_on(Device::cpu));
  // The residual of 1e-5 of the weight moves a vertex by 1e-5 h^2 g in a step; folds amplify it.
  constexpr double near = 1e-6 * 0.2;
  int compared = 0;
  for (int e = 0; e < device.size(); ++e) {
    SCOPED_TRACE(e);
    bool alike = true;
    for (int k = 0; k < steps; ++k) {
      EXPECT_TRUE(device.stats(e)[k].converged);
      alike = alike && device.stats(e)[k].substeps == cpu.stats(e)[k].substeps;
    }
    // At a threshold rounding decides whether a step is halved, and the halves are another discretization.
    if (!alike) continue;
    ++compared;
    for (int k = 0; k < 5; ++k)
      EXPECT_LE((device.kept_positions(e, k) - cpu.kept_positions(e, k)).cwiseAbs().maxCoeff(), near);
    const State &own = device.state(e), &expected = cpu.state(e);
    EXPECT_LE((own.positions - expected.positions).cwiseAbs().maxCoeff(), near);
    EXPECT_LE((own.velocities - expected.velocities).cwiseAbs().maxCoeff(), near / 0.01);
    EXPECT_NEAR(own.time, expected.time, 1e-12);
    ASSERT_EQ(own.held.size(), expected.held.size());
    for (std::size_t k = 0; k < own.held.size(); ++k)
      EXPECT_EQ(own.held[k].vertices, expected.held[k].vertices);
    EXPECT_TRUE(own.held[1].vertices.empty());
    const std::ptrdiff_t forces_each = steps * std::ssize(own.held) * 3;
    const View<double> forces = device.hold_forces(), cpu_forces = cpu.hold_forces();
    for (std::ptrdiff_t k = e * forces_each; k < (e + 1) * forces_each; ++k)
      EXPECT_NEAR(forces.data[k], cpu_forces.data[k], 1e-4 + 1e-3 * std::abs(cpu_forces.data[k]));
  }
  EXPECT_GE(compared, least);
}

TEST(DeviceBatch, IsThatOfTheProcessor) {
  SKIP_WITHOUT_DEVICE();
  const auto plan = sheet();
  expect_as_on_the_processor(plan, lifts(*plan, 6), 4);
}

TEST(DeviceBatch, SoftHoldsAreThoseOfTheProcessor) {
  SKIP_WITHOUT_DEVICE();
  const auto plan = sheet();
  expect_as_on_the_processor(plan, soft_lifts(*plan, 8), 5);
}

TEST(DeviceBatch, SoftHoldsTakeAsManyIterationsAsRigidOnes) {
  SKIP_WITHOUT_DEVICE();
  const auto plan = sheet();
  BatchSettings settings = settings_on(Device::cuda);
  settings.solver = {};
  std::vector<Environment> environments;
  for (const double modulus : {0.0, 1e6, 1e8, 1e10, 1e11}) {
    environments.push_back(lift(*plan, 0));
    if (modulus == 0) continue;
    Hold& grasp = environments.back().holds[0];
    grasp.stiffness.resize(std::ssize(grasp.vertices));
    for (std::size_t v = 0; v < grasp.vertices.size(); ++v)
      grasp.stiffness[static_cast<Eigen::Index>(v)] = modulus * plan->sheet.vertex_area[grasp.vertices[v]];
  }
  const Batch batch = run(plan, environments, settings);
  const auto work_of = [&](int e) {
    std::pair<int, int> sums;
    for (const StepStats& step : batch.stats(e)) {
      EXPECT_TRUE(step.converged) << e;
      sums.first += step.iterations;
      sums.second += step.solves;
    }
    return sums;
  };
  const auto [iterations, solves] = work_of(0);
  for (int e = 1; e < batch.size(); ++e) {
    const auto [own, own_solves] = work_of(e);
    EXPECT_LE(own, 1.2 * iterations) << e;
    EXPECT_LE(own_solves, 1.3 * solves) << e;
  }
}

TEST(DeviceBatch, EqualsItsEnvironmentsAloneBitForBit) {
  SKIP_WITHOUT_DEVICE();
  const auto plan = sheet();
  auto environments = soft_lifts(*plan, 6);
  // All have as many holds.
  for (int e = 0; e < 7; ++e) {
    environments.push_back(lift(*plan, e));
    environments.back().holds.resize(4, {.vertices = {40}, .from = 100});
  }
  const Batch together = run(plan, environments, settings_on(Device::cuda));
  for (int e = 0; e < together.size(); ++e) {
    const Batch alone = run(plan, {environments[static_cast<std::size_t>(e)]}, settings_on(Device::cuda));
    EXPECT_EQ(together.state(e).positions, alone.state(0).positions);
    EXPECT_EQ(together.state(e).velocities, alone.state(0).velocities);
  }
}

TEST(DeviceBatch, IsTheSameOnSeveralDevicesBitForBit) {
  SKIP_WITHOUT_DEVICE();
  const std::vector<int> all = choose_device("cuda:all").cuda_devices;
  if (all.size() < 2) GTEST_SKIP() << "one CUDA device, needs two";
  const auto plan = sheet();
  const auto environments = lifts(*plan, 9);
  const Batch on_first = run(plan, environments, settings_on(Device::cuda));
  for (const std::vector<int>& devices : {all, std::vector<int>{all.back()}}) {
    BatchSettings settings = settings_on(Device::cuda);
    settings.cuda_devices = devices;
    const Batch shared_out = run(plan, environments, settings);
    for (int e = 0; e < shared_out.size(); ++e) {
      EXPECT_EQ(shared_out.state(e).positions, on_first.state(e).positions);
      EXPECT_EQ(shared_out.state(e).velocities, on_first.state(e).velocities);
      EXPECT_EQ(shared_out.kept_positions(e, 3), on_first.kept_positions(e, 3));
    }
  }
}

TEST(DeviceBatch, SaysWhereItsTimeGoes) {
  SKIP_WITHOUT_DEVICE();
  const auto plan = sheet();
  const Batch batch = run(plan, lifts(*plan, 2), settings_on(Device::cuda));
  double all = 0;
  for (const PhaseShare& phase : batch.phases()) {
    EXPECT_GE(phase.share, 0) << phase.name;
    all += phase.share;
  }
  EXPECT_NEAR(all, 1, 1e-12);
}

TEST(DeviceBatch, EndsSoonAfterItIsStopped) {
  SKIP_WITHOUT_DEVICE();
  const auto plan = sheet();
  const std::atomic<bool> stop = true;
  BatchSettings settings = settings_on(Device::cuda);
  settings.solver.stop = &stop;
  Batch batch(plan, lifts(*plan, 2), settings);
  EXPECT_THROW(batch.advance(steps), data::Stopped);
}

TEST(DeviceBatch, WhatTheDeviceCannotDoIsRefusedByName) {
  const auto plan = sheet();
  Environment environment = lift(*plan, 0);
  EXPECT_EQ(why_not_on_device(environment), "");
  environment.obstacles.resize(9, {Plane{}});
  EXPECT_EQ(why_not_on_device(environment), "more than 8 obstacles: found 9");
  environment.obstacles = {{Mesh{}}};
  EXPECT_EQ(why_not_on_device(environment), "obstacles of shape mesh are met on the CPU alone");
  const auto changed = [&](auto change) {
    Environment other = lift(*plan, 0);
    change(other);
    return why_not_on_device(other);
  };
  EXPECT_EQ(changed([](Environment& e) { e.solids[0] = {}; }),
            "solids (element_type TETRAHEDRON) are simulated on the CPU alone");
  EXPECT_EQ(changed([](Environment& e) { e.self_contact = SelfContact{}; }),
            "self-contact (self_contact) is simulated on the CPU alone");
  EXPECT_EQ(changed([](Environment& e) {
              e.point_masses.push_back({0, 0.1});
            }),
            "point masses (attached_mass) are simulated on the CPU alone");
  EXPECT_EQ(changed([](Environment& e) { e.materials.push_back(e.materials[0]); }),
            "several bodies in one environment");
  EXPECT_EQ(changed([](Environment& e) { e.materials[0].yield_curvature = 10; }),
            "bending that yields (yield_curvature) is simulated on the CPU alone");
  EXPECT_EQ(changed([](Environment& e) { e.materials[0].weave.young_ratio = 0.5; }),
            "woven membranes (young_ratio, shear_ratio) are simulated on the CPU alone");
  Batch batch(plan, {environment}, settings_on(Device::cuda));
  EXPECT_THROW(batch.advance(1), data::InputError);
  BatchSettings with_contacts = settings_on(Device::cuda);
  with_contacts.contacts = true;
  Batch told(plan, {lift(*plan, 0)}, with_contacts);
  try {
    told.advance(1);
    FAIL() << "it has to be refused";
  } catch (const data::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("(contacts) are told on the CPU alone"), std::string::npos);
  }
  BatchSettings projective = settings_on(Device::cuda);
  projective.projective.emplace();
  Batch published(plan, {lift(*plan, 0)}, projective);
  EXPECT_EQ(data::input_error_of([&] { published.advance(1); }),
            "--device cuda: the projective method runs on the CPU alone");
  environment.obstacles.clear();
  environment.state.positions = data::Points::Zero(65537, 3);
  EXPECT_EQ(why_not_on_device(environment), "more than 65536 vertices: found 65537");
}

}  // namespace
}  // namespace flash::sim
