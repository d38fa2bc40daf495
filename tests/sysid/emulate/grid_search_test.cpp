#include "sysid/emulate/grid_search.h"

#include <gtest/gtest.h>

#include "data/atomic_file.h"
#include "sysid/emulate/fingerprint.h"
#include "tests/sysid/short_lift.h"

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

}  // namespace
}  // namespace flash::sysid
