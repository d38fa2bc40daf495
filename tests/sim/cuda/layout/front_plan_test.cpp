#include "sim/cuda/layout/front_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "tests/sim/cuda/meshes.h"

namespace flash::sim::cuda {
namespace {

std::vector<NamedPlan> plans() {
  std::vector<NamedPlan> all = small_plans();
  all.push_back({"1,024 vertices", make_sheet_plan(make_sheet(data::rectangle(
                                       {.width = 0.4, .height = 0.4, .cells_x = 31, .cells_y = 31})))});
  return all;
}

FrontPlan plan_of(const SheetPlan& plan, int capacity) {
  return plan_fronts(plan.pattern, plan.sheet.rest.vertices, {.leaf_size = 6, .panel_capacity = capacity});
}

/// The fill of the pattern under the plan's order, by elimination vertex after vertex.
std::vector<std::vector<bool>> fill(const BlockPattern& pattern, const std::vector<int>& position) {
  std::vector<std::vector<bool>> lower(pattern.size, std::vector<bool>(pattern.size, false));
  for (const auto& [a, b] : pattern.pairs)
    lower[std::max(position[a], position[b])][std::min(position[a], position[b])] = true;
  for (int column = 0; column < pattern.size; ++column)
    for (int i = column + 1; i < pattern.size; ++i)
      if (lower[i][column])
        for (int j = column + 1; j < i; ++j)
          if (lower[j][column]) lower[i][j] = true;
  return lower;
}

TEST(FrontPlan, FrontsHoldTheFactorAndAllOfTheMatrix) {
  for (const auto& [name, sheet] : small_plans()) {
    SCOPED_TRACE(name);
    const FrontPlan plan = plan_of(*sheet, 2000);
    const auto lower = fill(sheet->pattern, plan.position);
    std::vector<int> owner(plan.size, -1);
    for (std::size_t f = 0; f < plan.fronts.size(); ++f)
      for (int c = 0; c < plan.fronts[f].column_count; ++c) {
        EXPECT_EQ(owner[plan.fronts[f].first_column + c], -1);
        owner[plan.fronts[f].first_column + c] = static_cast<int>(f);
      }
    for (int column = 0; column < plan.size; ++column) {
      ASSERT_GE(owner[column], 0);
      const FrontLayout& front = plan.fronts[owner[column]];
      const auto begin = plan.rows.begin() + front.first_row, end = begin + front.row_count;
      for (int row = column + 1; row < plan.size; ++row) {
        const bool stored =
            row < front.first_column + front.column_count || std::binary_search(begin, end, row);
        EXPECT_TRUE(stored || !lower[row][column]);
      }
    }
    EXPECT_EQ(plan.blocks.size(), plan.size + sheet->pattern.pairs.size());
  }
}

TEST(FrontPlan, WhatAChildPassesUpHasItsPlaceInTheParent) {
  for (const auto& [name, sheet] : plans()) {
    SCOPED_TRACE(name);
    const FrontPlan plan = plan_of(*sheet, 24 * 1024);
    for (const FrontLayout& front : plan.fronts) {
      std::vector<int> vertices(front.column_count);
      std::iota(vertices.begin(), vertices.end(), front.first_column);
      vertices.insert(vertices.end(), plan.rows.begin() + front.first_row,
                      plan.rows.begin() + front.first_row + front.row_count);
      for (int k = 0; k < 2; ++k) {
        if (front.children[k] < 0) continue;
        const FrontLayout& child = plan.fronts[front.children[k]];
        int found = 0;
        for (std::size_t v = 0; v < vertices.size(); ++v) {
          const int place = plan.child_rows[front.first_map + k * vertices.size() + v];
          if (place < 0) continue;
          EXPECT_EQ(plan.rows[child.first_row + place], vertices[v]);
          ++found;
        }
        EXPECT_EQ(found, child.row_count);
      }
    }
  }
}

TEST(FrontPlan, NoTwoFrontsUseTheSameMemoryAtATime) {
  for (const auto& [name, sheet] : plans()) {
    SCOPED_TRACE(name);
    const FrontPlan plan = plan_of(*sheet, 24 * 1024);
    const int count = static_cast<int>(plan.fronts.size());
    std::vector<int> height(count), last(count);
    for (std::size_t l = 0; l < plan.levels.size(); ++l)
      for (int f = plan.levels[l].first_front; f < plan.levels[l].first_front + plan.levels[l].front_count;
           ++f)
        height[f] = last[f] = static_cast<int>(l);
    for (int f = 0; f < count; ++f)
      for (const int child : plan.fronts[f].children)
        if (child >= 0) {
          EXPECT_LT(height[child], height[f]);
          last[child] = height[f];
        }
    const auto apart = [](long a, long a_size, long b, long b_size) {
      return a + a_size <= b || b + b_size <= a;
    };
    for (int f = 0; f < count; ++f) {
      const FrontLayout& a = plan.fronts[f];
      const long update = 3L * a.row_count * a.update_leading;
      EXPECT_LE(a.update_at + update, plan.update_size);
      for (int g = 0; g < f; ++g) {
        const FrontLayout& b = plan.fronts[g];
        EXPECT_TRUE(
            apart(a.first_tile, a.row_tiles * a.column_tiles, b.first_tile, b.row_tiles * b.column_tiles));
        if (last[g] < height[f] || last[f] < height[g]) continue;
        EXPECT_TRUE(apart(a.update_at, update, b.update_at, 3L * b.row_count * b.update_leading));
      }
    }
  }
}

TEST(FrontPlan, PanelsFitOnChip) {
  for (const auto& [name, sheet] : plans()) {
    SCOPED_TRACE(name);
    for (const int capacity : {12 * 1024, 24 * 1024}) {
      const FrontPlan plan = plan_of(*sheet, capacity);
      EXPECT_LE(plan.shared_panel, capacity);
      for (const FrontLevel& level : plan.levels) {
        EXPECT_LE(level.groups, block_warps);
        for (int f = level.first_front; f < level.first_front + level.front_count; ++f) {
          const FrontLayout& front = plan.fronts[f];
          // All panels of a level at a time.
          EXPECT_LE(level.groups * panel_numbers(3 * front.column_count, 3 * front.row_count,
                                                 front.children[0] >= 0 || front.children[1] >= 0),
                    plan.shared_panel);
        }
      }
    }
  }
}

}  // namespace
}  // namespace flash::sim::cuda
