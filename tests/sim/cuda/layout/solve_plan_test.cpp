#include "sim/cuda/layout/solve_plan.h"

#include <gtest/gtest.h>

#include <map>
#include <utility>

#include "tests/sim/cuda/meshes.h"

namespace flash::sim::cuda {
namespace {

/// How often the numbers of the factor are in chunks, those of one direction.
std::map<int, int> uses(const SolvePlan& solve, bool backward) {
  std::map<int, int> uses;
  for (const SolveChunk& chunk : solve.chunks) {
    if (((chunk.flags & SolveChunk::backward) != 0) != backward) continue;
    for (int column = 0; column < chunk.columns; ++column)
      for (int row = 0; row < chunk.rows; ++row) ++uses[chunk.panel_at + column * chunk.leading + row];
  }
  return uses;
}

TEST(SolvePlan, EachNumberOnAndBelowTheDiagonalIsReadOnceEachWay) {
  for (const auto& [name, sheet] : small_plans()) {
    SCOPED_TRACE(name);
    const FrontPlan fronts = plan_fronts(sheet->pattern, sheet->sheet.rest.vertices);
    const SolvePlan solve = plan_solve(fronts);
    for (const bool backward : {false, true}) {
      const std::map<int, int> read = uses(solve, backward);
      for (const auto& [at, count] : read) {
        EXPECT_EQ(count, 1);
        EXPECT_LT(at, fronts.factor_size);
      }
      for (const FrontLayout& front : fronts.fronts)
        for (int column = 0; column < 3 * front.column_count; ++column)
          for (int row = column; row < front.leading; ++row)
            EXPECT_TRUE(read.contains(static_cast<int>(front.panel_at) + column * front.leading + row));
    }
  }
}

TEST(SolvePlan, EachWarpGoesThroughAllHeightsBothWays) {
  for (const auto& [name, sheet] : small_plans()) {
    SCOPED_TRACE(name);
    const FrontPlan fronts = plan_fronts(sheet->pattern, sheet->sheet.rest.vertices);
    const SolvePlan solve = plan_solve(fronts);
    ASSERT_EQ(solve.starts.size(), std::size_t{team_warps} + 1);
    for (std::size_t w = 0; w < team_warps; ++w) {
      std::size_t levels = 0;
      int open = 0;  // chunks of a task follow each other
      for (int k = solve.starts[w]; k < solve.starts[w + 1] - chunks_ahead; ++k) {
        const SolveChunk& chunk = solve.chunks[static_cast<std::size_t>(k)];
        EXPECT_LE(chunk.columns, chunk_columns);
        EXPECT_LE(chunk.rows, chunk_rows);
        EXPECT_EQ((chunk.flags & SolveChunk::backward) != 0, levels >= fronts.levels.size());
        if (chunk.columns > 0) {
          EXPECT_EQ((chunk.flags & SolveChunk::begins) != 0, open == 0);
          open = (chunk.flags & SolveChunk::ends) != 0 ? 0 : 1;
        }
        if ((chunk.flags & SolveChunk::ends_level) != 0) {
          EXPECT_EQ(open, 0);
          ++levels;
        }
      }
      EXPECT_EQ(levels, 2 * fronts.levels.size());
    }
  }
}

}  // namespace
}  // namespace flash::sim::cuda
