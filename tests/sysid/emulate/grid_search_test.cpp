#include "sysid/emulate/grid_search.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

#include "data/files/atomic_file.h"
#include "sim/device.h"
#include "sim/device_error.h"
#include "sysid/emulate/fingerprint.h"
#include "tests/sysid/short_lift.h"
#ifdef FLASH_HAVE_CUDA
#include "tests/sim/cuda/device_faults.h"
#endif

namespace flash::sysid {
namespace {

class GridSearch : public ::testing::Test {
 protected:
  GridSearch() : replays({short_lift(folder)}) {
    grid.base.material = short_lift_material();
    grid.axes = {parse_axis("bending", "1e-4:4e-4:3:log"), parse_axis("friction", "0.2,0.4")};
  }

  ResultsStore store(const std::string& name, Existing existing = Existing::refuse) const {
    return {folder / name, grid.axes, {"lift"}, fingerprint(replays, grid), existing};
  }

  /// What a search leaves behind.
  std::string written(const std::string& name) const {
    std::string text;
    for (const char* file : {"/results.csv", "/registrations.csv", "/keyframes.csv"})
      text += data::read_file((folder / name) + file);
    return text;
  }

  const data::TemporaryFolder folder;
  const std::vector<Replay> replays;
  GridSettings grid;
};

TEST_F(GridSearch, WritesTheSameFilesOnAnyNumberOfThreads) {
  for (const int threads : {1, 2, 4}) {
    const std::string name = "on_" + std::to_string(threads);
    grid.threads = threads;
    grid.envs = 5;  // five candidates at once, then the last one
    grid.rollouts = folder / ("rollouts_" + std::to_string(threads));
    ResultsStore results = store(name);
    std::vector<int> done;  // of no thread's own: `progress` is called one thread at a time
    EXPECT_TRUE(grid_search(replays, grid, results, [&](const Progress& p) { done.push_back(p.done); }));
    EXPECT_EQ(done, (std::vector<int>{1, 2, 3, 4, 5, 6}));
    EXPECT_EQ(written(name), written("on_1"));
  }
}

TEST_F(GridSearch, GoesOnWhereItWasStopped) {
  grid.threads = 2;
  ResultsStore whole = store("whole");
  EXPECT_TRUE(grid_search(replays, grid, whole));
  {
    std::atomic<bool> stop = false;
    ResultsStore first = store("parts");
    EXPECT_FALSE(grid_search(
        replays, grid, first, [&](const Progress& p) { stop = p.done >= 2; }, &stop));
    EXPECT_LT(first.results().candidates.size(), 6u);
  }
  ResultsStore rest = store("parts", Existing::resume);
  EXPECT_TRUE(grid_search(replays, grid, rest));
  EXPECT_EQ(written("parts"), written("whole"));
}

TEST_F(GridSearch, GoesOnAfterADeviceFailed) {
  grid.envs = 4;
  grid.rollouts = folder / "rollouts";
  ResultsStore whole = store("whole");
  EXPECT_TRUE(grid_search(replays, grid, whole));
  {
    ResultsStore first = store("parts");
    const auto fail = [](const Progress& p) {
      if (p.done == 3) throw sim::DeviceError("CUDA device 0: lost", {2});
    };
    try {
      grid_search(replays, grid, first, fail);
      ADD_FAILURE() << "it went on";
    } catch (const sim::DeviceError& error) {
      EXPECT_EQ(error.why(), "CUDA device 0: lost");
    }
    EXPECT_EQ(first.results().candidates.size(), 3u);
  }
  ResultsStore rest = store("parts", Existing::resume);
  EXPECT_TRUE(grid_search(replays, grid, rest));
  EXPECT_EQ(written("parts"), written("whole"));
}

#ifdef FLASH_HAVE_CUDA

TEST_F(GridSearch, GoesOnAfterADeviceWasLost) {
  if (const std::string why = sim::why_no_cuda(); !why.empty()) GTEST_SKIP() << why;
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  std::vector<Replay> on_device = replays;
  on_device[0].settings.device = sim::Device::cuda;
  grid.envs = 2;
  // The process that loses its device runs this test from its beginning: it finds the folder named already.
  setenv("FLASH_LOST_SEARCH", (folder / "parts").c_str(), 0);
  const std::string parts = getenv("FLASH_LOST_SEARCH");
  const auto results_in = [&](const std::string& path, Existing existing) {
    return ResultsStore(path, grid.axes, {"lift"}, fingerprint(on_device, grid), existing);
  };
  const auto lose_device_at_three = [&] {
    ResultsStore first = results_in(parts, Existing::refuse);
    try {
      grid_search(on_device, grid, first, [](const Progress& p) {
        if (p.done == 2) sim::cuda::lose_device();
      });
    } catch (const sim::DeviceError& error) {
      std::fprintf(stderr, "%zu kept; %s\n", first.results().candidates.size(), error.what());
      std::exit(1);
    }
  };
  EXPECT_EXIT(lose_device_at_three(), testing::ExitedWithCode(1),
              "2 kept; CUDA device.*: .*; no result of candidates 2, 3");
  unsetenv("FLASH_LOST_SEARCH");
  ResultsStore rest = results_in(folder / "parts", Existing::resume);
  EXPECT_EQ(rest.results().candidates.size(), 2u);
  EXPECT_TRUE(grid_search(on_device, grid, rest));
  ResultsStore whole = results_in(folder / "whole", Existing::refuse);
  EXPECT_TRUE(grid_search(on_device, grid, whole));
  EXPECT_EQ(written("parts"), written("whole"));
}

#endif

}  // namespace
}  // namespace flash::sysid
