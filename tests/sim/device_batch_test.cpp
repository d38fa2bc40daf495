// Batches on the device beside those on the processor.
#include "sim/device_batch.h"

#include <gtest/gtest.h>

#include "data/error.h"
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

TEST(DeviceBatch, IsThatOfTheProcessor) {
  SKIP_WITHOUT_DEVICE();
  const auto plan = sheet();
  const auto environments = lifts(*plan, 6);
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
    ASSERT_EQ(own.held.size(), 2u);
    EXPECT_EQ(own.held[0].vertices, expected.held[0].vertices);
    EXPECT_TRUE(own.held[1].vertices.empty());
    constexpr std::ptrdiff_t forces_each = steps * 2 * 3;
    const View<double> forces = device.hold_forces(), cpu_forces = cpu.hold_forces();
    for (std::ptrdiff_t k = e * forces_each; k < (e + 1) * forces_each; ++k)
      EXPECT_NEAR(forces.data[k], cpu_forces.data[k], 1e-4 + 1e-3 * std::abs(cpu_forces.data[k]));
  }
  EXPECT_GE(compared, 4);
}

TEST(DeviceBatch, EqualsItsEnvironmentsAloneBitForBit) {
  SKIP_WITHOUT_DEVICE();
  const auto plan = sheet();
  const auto environments = lifts(*plan, 7);
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
  environment.obstacles.clear();
  environment.state.positions = data::Points::Zero(65537, 3);
  EXPECT_EQ(why_not_on_device(environment), "more than 65536 vertices: found 65537");
}

}  // namespace
}  // namespace flash::sim
