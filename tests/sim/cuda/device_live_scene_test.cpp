// Live scenes on a device beside those of the processor; what both have in common is in
// tests/sim/live_scene_test.cpp.
#ifdef FLASH_HAVE_CUDA
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "data/files/error.h"
#include "sim/live_scene.h"
#include "tests/sim/cuda/device_numbers.h"
#include "tests/sim/live_scene_fixture.h"

namespace flash::sim {
namespace {

#define SKIP_WITHOUT_DEVICE() \
  if (const std::string why = why_no_cuda(); !why.empty()) GTEST_SKIP() << why

const DeviceChoice on_cuda{.device = Device::cuda};

class DeviceLiveScenes : public LiveScenes {
 protected:
  /// One sheet, solved so well that what is left unsolved is small.
  data::Scene exact_scene() const {
    data::Scene exact = scene(false, false);
    exact.solver.tolerance = tolerance;
    return exact;
  }
  static constexpr double tolerance = 1e-6;
};

double farthest_apart(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0;
  for (std::size_t k = 0; k < a.size(); ++k) most = std::max(most, std::abs(a[k] - b[k]));
  return most;
}

// As DeviceWorlds.AreThoseOfTheProcessorToTheTolerance says: by the tolerance times g t^2, five times that
// where a vertex sticks on one and slides on the other.
TEST_F(DeviceLiveScenes, AHandThatIsAddedLiftsAsOnTheProcessor) {
  SKIP_WITHOUT_DEVICE();
  constexpr int environments = 3, steps = 30;
  LiveScene processor(exact_scene(), environments, 1), device(exact_scene(), environments, 1, on_cuda);
  const double time = steps * processor.time_step(), near = 5 * tolerance * 9.81 * time * time;
  EndEffector solid_hand = hand();
  solid_hand.collides = true;
  for (LiveScene* live : {&processor, &device}) {
    live->add_end_effector(solid_hand, tensor(poses(environments, 0.05), {environments, 7}));
    drive(*live, 0, steps);
  }
  EXPECT_EQ(device.held("hand"), processor.held("hand"));
  EXPECT_GT(device.held("hand")[0], 0);
  const Tensor view = device.positions("a");
  EXPECT_EQ(view.device, Device::cuda);
  const std::vector<double> there = cuda::numbers_of(view);
  std::vector<double> here;
  for (int e = 0; e < environments; ++e) {
    const std::vector<double> own = row(processor.positions("a"), e);
    here.insert(here.end(), own.begin(), own.end());
  }
  ASSERT_EQ(there.size(), here.size());
  EXPECT_LE(farthest_apart(there, here), near);
  const double weight = 0.2 * 0.2 * 0.2 * 9.81;
  for (int e = 0; e < environments; ++e)
    EXPECT_LE(farthest_apart(row(device.force("hand"), e), row(processor.force("hand"), e)), 1e-2 * weight);
}

TEST_F(DeviceLiveScenes, ViewsStayWhenAHandIsAddedAndGoWithTheSteps) {
  SKIP_WITHOUT_DEVICE();
  LiveScene live(scene(true, false), 2, 1, on_cuda);
  EXPECT_EQ(live.device().cuda_devices, std::vector{0});
  const Tensor x = live.positions("b"), table = live.on_device(live.force("table")),
               status = live.on_device(live.status());
  live.add_end_effector(hand(), tensor(poses(2, 0.05), {2, 7}));
  const Tensor of_hand = live.on_device(live.force("hand"));
  EXPECT_EQ(live.positions("b").data, x.data);
  drive(live, 0, 20);
  live.reset(std::vector{1});
  const auto expect_shown = [](const Tensor& there, const Tensor& here) {
    EXPECT_EQ(there.device, Device::cuda);
    std::vector<double> all;
    for (int e = 0; e < 2; ++e) {
      const std::vector<double> own = row(here, e);
      all.insert(all.end(), own.begin(), own.end());
    }
    EXPECT_EQ(cuda::numbers_of(there), all);
    EXPECT_NE(all, std::vector<double>(all.size()));
  };
  expect_shown(table, live.force("table"));
  expect_shown(of_hand, live.force("hand"));
  expect_shown(status, live.status());
  EXPECT_EQ(cuda::numbers_of(status)[0], 20);
  EXPECT_EQ(live.on_device(live.status()).data, status.data);
  EXPECT_EQ(cuda::numbers_of(x), cuda::numbers_of(live.positions("b")));
}

// Free fall without a table in reach: v = g t exactly, each environment its own g.
TEST_F(DeviceLiveScenes, GravityIsThatOfEachEnvironment) {
  SKIP_WITHOUT_DEVICE();
  constexpr int environments = 3, steps = 10;
  LiveScene live(exact_scene(), environments, 1, on_cuda);
  const std::vector<double> gravity = {0, 0, 1, 0, 2, 0.5, 3, 0, 0};
  live.set_gravity({}, tensor(gravity, {environments, 3}));
  live.step(steps);
  const std::vector<double> velocities = cuda::numbers_of(live.velocities("a"));
  const std::size_t each = velocities.size() / environments;
  for (std::size_t k = 0; k < velocities.size(); ++k) {
    const std::size_t e = k / each, axis = k % 3;
    if (e == 2) continue;  // along the table, on which it lies
    EXPECT_NEAR(velocities[k], gravity[3 * e + axis] * steps * live.time_step(), 1e-6);
  }
}

// On a table that gravity presses on with p it accelerates by g - mu p along it.
TEST_F(DeviceLiveScenes, FrictionIsThatOfEachEnvironment) {
  SKIP_WITHOUT_DEVICE();
  constexpr int environments = 2, steps = 20;
  LiveScene live(exact_scene(), environments, 1, on_cuda);
  const std::vector<double> gravity = {4, 0, -9.81, 4, 0, -9.81}, friction = {0.1, 0.3};
  live.set_gravity({}, tensor(gravity, {environments, 3}));
  live.set_friction("a", "table", {}, friction);
  live.step(steps);
  const std::vector<double> velocities = cuda::numbers_of(live.velocities("a"));
  const std::size_t each = velocities.size() / environments;
  for (std::size_t e = 0; e < environments; ++e) {
    double mean = 0;
    for (std::size_t k = 0; k < each; k += 3)
      mean += velocities[e * each + k] / static_cast<double>(each / 3);
    const double expected = (4 - friction[e] * 9.81) * steps * live.time_step();
    EXPECT_NEAR(mean, expected, 0.02 * expected) << e;
  }
}

TEST_F(DeviceLiveScenes, WhatIsSavedGoesOnAndWhatIsResetBeginsAgain) {
  SKIP_WITHOUT_DEVICE();
  LiveScene live(scene(true, false), 2, 1, on_cuda);
  live.add_end_effector(hand(), tensor(poses(2, 0.05), {2, 7}));
  drive(live, 0, 12);
  const auto saved = live.save({});
  drive(live, 12, 20);
  const std::vector<double> end = cuda::numbers_of(live.positions("a"));
  live.load({}, *saved);
  drive(live, 12, 20);
  EXPECT_EQ(cuda::numbers_of(live.positions("a")), end);
  live.reset({});
  drive(live, 0, 20);
  EXPECT_EQ(cuda::numbers_of(live.positions("a")), end);
}

TEST_F(DeviceLiveScenes, WhatADeviceCannotDoIsRefusedWithTheScene) {
  SKIP_WITHOUT_DEVICE();
  try {
    const LiveScene live(scene(true, true), 1, 1, on_cuda);
    ADD_FAILURE() << "not refused";
  } catch (const data::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("self-contact"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace flash::sim
#endif
