// What becomes of a batch whose environments diverge, or whose device has no room or is lost.
#ifdef FLASH_HAVE_CUDA
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <mutex>
#include <numeric>

#include "sim/batch.h"
#include "sim/device_error.h"
#include "sim/worlds.h"
#include "tests/sim/cuda/device_faults.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

#define SKIP_WITHOUT_DEVICE() \
  if (const std::string why = why_no_cuda(); !why.empty()) GTEST_SKIP() << why

constexpr int steps = 10;

std::shared_ptr<const SheetPlan> sheet(int cells) { return make_sheet_plan(small_sheet(cells, 0.16)); }

/// Sheets that slide on a table, each of its own stiffness.
std::vector<Environment> slides(const SheetPlan& plan, int count) {
  std::vector<Environment> all;
  for (int e = 0; e < count; ++e) {
    Environment& environment = all.emplace_back(environment_of(plan.sheet));
    environment.materials[0].membrane_stiffness = 40.0 + e;
    environment.materials[0].bending_rigidity = 5e-5;
    environment.materials[0].areal_density = 0.2;
    environment.materials[0].friction = 0.3;
    environment.obstacles = {{Plane{}}};
    environment.state.velocities.col(0).setConstant(0.3);
  }
  return all;
}

BatchSettings settings_on(Device device) {
  BatchSettings settings;
  settings.steps = steps;
  settings.threads = 2;
  settings.device = device;
  return settings;
}

/// What a device makes of environments: their states and the numbers of those that have finished.
struct Taken {
  std::vector<State> states;
  std::vector<std::size_t> finished, without_result;
  std::string error;
};

Taken take(const std::shared_ptr<const SheetPlan>& plan, const std::vector<Environment>& environments) {
  Taken taken;
  std::mutex mutex;
  Batch batch(plan, environments, settings_on(Device::cuda));
  try {
    batch.advance(steps, [&](int e) {
      const std::scoped_lock lock(mutex);
      taken.finished.push_back(static_cast<std::size_t>(e));
    });
  } catch (const DeviceError& error) {
    taken.error = error.what();
    taken.without_result = error.without_result();
  }
  for (int e = 0; e < batch.size(); ++e) taken.states.push_back(batch.state(e));
  std::sort(taken.finished.begin(), taken.finished.end());
  return taken;
}

/// Whether all have room on the device at once.
bool fit(const std::shared_ptr<const SheetPlan>& plan, const std::vector<Environment>& environments) {
  try {
    const Worlds worlds(plan, environments, {.device = Device::cuda, .steps_at_once = steps});
    return true;
  } catch (const OutOfDeviceMemory&) {
    return false;
  }
}

class DivergesOn : public testing::TestWithParam<Device> {
 protected:
  void SetUp() override {
    if (GetParam() == Device::cuda && !why_no_cuda().empty()) GTEST_SKIP() << why_no_cuda();
  }
};
INSTANTIATE_TEST_SUITE_P(Devices, DivergesOn, testing::Values(Device::cpu, Device::cuda),
                         [](const auto& device) { return device.param == Device::cpu ? "cpu" : "cuda"; });

TEST_P(DivergesOn, AnEnvironmentIsToldByItsNumberAndTheOthersAreAsWithoutIt) {
  const auto plan = sheet(8);
  const std::vector<Environment> good = slides(*plan, 4);
  std::vector<Environment> environments = good;
  environments[1].materials[0].membrane_stiffness = 1e300;  // whose forces no number holds
  environments[2].state.positions(5, 1) = std::numeric_limits<double>::quiet_NaN();
  Batch batch(plan, environments, settings_on(GetParam())), alone(plan, good, settings_on(GetParam()));
  batch.advance(steps);
  alone.advance(steps);
  for (const int e : {1, 2}) EXPECT_FALSE(batch.stats(e).back().converged) << e;
  EXPECT_EQ(batch.stats(2).back().residual, std::numeric_limits<double>::infinity());
  EXPECT_TRUE(batch.state(1).positions.allFinite());
  for (const int e : {0, 3}) {
    EXPECT_TRUE(batch.stats(e).back().converged);
    EXPECT_EQ(batch.state(e).positions, alone.state(e).positions);
    EXPECT_EQ(batch.state(e).velocities, alone.state(e).velocities);
  }
}

TEST(DeviceMemory, ThatDoesNotSufficeMakesWavesAndAtLastNamesTheEnvironments) {
  SKIP_WITHOUT_DEVICE();
  constexpr int count = 96;
  const auto plan = sheet(20);
  const std::vector<Environment> environments = slides(*plan, count);
  const Taken whole = take(plan, environments);
  ASSERT_EQ(whole.error, "");
  EXPECT_TRUE(fit(plan, environments));
  bool in_waves = false, in_vain = false;
  for (std::size_t left = std::size_t{1} << 28; left >= std::size_t{1} << 16 && !in_vain; left /= 2) {
    SCOPED_TRACE(testing::Message() << left / 1024 << " KB left");
    bool at_once = false;
    const Taken taken = [&] {
      const cuda::FullDevice full(left);
      at_once = fit(plan, environments);
      return take(plan, environments);
    }();
    in_waves = in_waves || (taken.error.empty() && !at_once);
    in_vain = !taken.error.empty();
    EXPECT_EQ(taken.finished.size() + taken.without_result.size(), static_cast<std::size_t>(count));
    for (const std::size_t e : taken.finished) {
      EXPECT_EQ(taken.states[e].positions, whole.states[e].positions);
      EXPECT_EQ(taken.states[e].velocities, whole.states[e].velocities);
    }
    if (!in_vain) continue;
    EXPECT_EQ(taken.error, "CUDA device 0: out of memory; no result of environments 0 to 95");
  }
  EXPECT_TRUE(in_waves);
  EXPECT_TRUE(in_vain);
  EXPECT_EQ(take(plan, environments).error, "");  // the device itself is well
}

TEST(LostDevice, EndsWithTheNumbersOfTheEnvironmentsThatItWasAt) {
  SKIP_WITHOUT_DEVICE();
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto plan = sheet(8);
  const auto lose_it_between_waves = [&] {
    std::vector<std::size_t> finished;
    try {
      replay_in_batches(
          plan, 9, 3, settings_on(Device::cuda), [&](std::size_t i) { return slides(*plan, 9)[i]; },
          [&](std::size_t i, const Batch&, int) {
            finished.push_back(i);
            if (finished.size() == 3) cuda::lose_device();
          });
    } catch (const DeviceError& error) {
      std::fprintf(stderr, "%zu finished; %s\n", finished.size(), error.what());
      std::exit(1);
    }
  };
  EXPECT_EXIT(lose_it_between_waves(), testing::ExitedWithCode(1),
              "3 finished; CUDA device.*: .*; no result of environments 3 to 5");
}

}  // namespace
}  // namespace flash::sim
#endif
