#include "sim/cuda/layout/dissection.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/sim/cuda/meshes.h"

namespace flash::sim::cuda {
namespace {

TEST(Dissection, EveryVertexComesOnceAndHalvesDoNotTouch) {
  for (const auto& [name, plan] : small_plans()) {
    SCOPED_TRACE(name);
    const BlockPattern& pattern = plan->pattern;
    const std::vector<DissectionNode> nodes = dissect(pattern, plan->sheet.rest.vertices, 6);
    std::vector<int> owner(pattern.size, -1), parent(nodes.size(), -1);
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      EXPECT_FALSE(nodes[n].vertices.empty());  // of parts that are not joined too
      for (const int vertex : nodes[n].vertices) {
        EXPECT_EQ(owner[vertex], -1);
        owner[vertex] = static_cast<int>(n);
      }
      for (const int child : nodes[n].children)
        if (child >= 0) {
          EXPECT_LT(child, static_cast<int>(n));
          EXPECT_EQ(parent[child], -1);
          parent[child] = static_cast<int>(n);
        }
    }
    for (std::size_t n = 0; n + 1 < nodes.size(); ++n) EXPECT_GE(parent[n], 0);
    const auto is_above = [&](int a, int b) {
      while (b != a && b >= 0) b = parent[b];
      return b == a;
    };
    for (const auto& [a, b] : pattern.pairs)
      EXPECT_TRUE(is_above(owner[a], owner[b]) || is_above(owner[b], owner[a]));
    EXPECT_EQ(std::count(owner.begin(), owner.end(), -1), 0);
  }
}

// A square grid of n x n vertices that reach two columns far: a tree of depth log2(n^2 / leaf), and a root of
// two columns.
TEST(Dissection, AGridHasALowTreeAndSmallSeparators) {
  const int n = 32;
  const auto plan = make_sheet_plan(
      make_sheet(data::rectangle({.width = 0.4, .height = 0.4, .cells_x = n - 1, .cells_y = n - 1})));
  const std::vector<DissectionNode> nodes = dissect(plan->pattern, plan->sheet.rest.vertices, 8);
  std::vector<int> height(nodes.size(), 0);
  for (std::size_t k = 0; k < nodes.size(); ++k)
    for (const int child : nodes[k].children)
      if (child >= 0) height[k] = std::max(height[k], height[child] + 1);
  EXPECT_LE(height.back(), 8);
  EXPECT_LE(nodes.back().vertices.size(), 2u * n);
}

}  // namespace
}  // namespace flash::sim::cuda
