#include "sim/cuda/layout/solve_plan.h"

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>

namespace flash::sim::cuda {
namespace {

using Task = std::vector<SolveChunk>;  ///< chunks that add up to one result

int number(long value) {
  if (value > std::numeric_limits<int>::max()) throw std::length_error("the sheet's factor is too large");
  return static_cast<int>(value);
}

/// Chunks of a front side by side, `rows` each.
Task forward_task(const FrontPlan& plan, const FrontLayout& front, int first_gather, int row, int rows) {
  const int columns = 3 * front.column_count;
  // Above the diagonal there are zeros.
  const int end = row + rows > front.below_at ? columns : std::min(columns, row + rows);
  SolveChunk chunk;
  chunk.leading = front.leading;
  chunk.rows = std::min(rows, front.leading - row);
  chunk.row_table_at = first_gather + front.column_count + std::max(0, row - front.below_at) / 3;
  chunk.first_row = row;
  chunk.own_columns = columns;
  chunk.below_at = front.below_at;
  chunk.below_count = 3 * front.row_count;
  chunk.y_at = 3 * front.first_column;
  chunk.passed_at = front.vector_at;
  Task task;
  for (int column = 0; column < end; column += chunk_columns) {
    chunk.flags =
        (column == 0 ? SolveChunk::begins : 0) | (column + chunk_columns >= end ? SolveChunk::ends : 0);
    chunk.columns = std::min(chunk_columns, end - column);
    chunk.panel_at = number(front.panel_at + static_cast<long>(column) * front.leading + row);
    chunk.right_at = 3 * (plan.size + front.first_column) + column;
    chunk.table_at = first_gather + column / 3;
    task.push_back(chunk);
  }
  return task;
}

/// Chunks of a front one below the other, `columns` each.
Task backward_task(const FrontPlan& plan, const FrontLayout& front, int column, int columns) {
  SolveChunk chunk;
  chunk.leading = front.leading;
  chunk.columns = std::min(columns, 3 * front.column_count - column);
  chunk.right_at = 3 * (plan.size + front.first_column) + column;
  Task task;
  // Above the diagonal there are zeros.
  for (int row = column; row < front.leading; row += chunk_rows) {
    chunk.flags = SolveChunk::backward | (row == column ? SolveChunk::begins : 0) |
                  (row + chunk_rows >= front.leading ? SolveChunk::ends : 0);
    chunk.rows = std::min(chunk_rows, front.leading - row);
    chunk.panel_at = number(front.panel_at + static_cast<long>(column) * front.leading + row);
    chunk.table_at = front.first_entry + row;
    task.push_back(chunk);
  }
  return task;
}

/// Tasks as large as leaves some for each warp.
template <typename Cut>
std::vector<Task> enough_tasks(const std::array<int, 3>& sizes, const Cut& cut) {
  std::vector<Task> tasks;
  for (const int size : sizes) {
    tasks = cut(size);
    if (tasks.size() >= 2 * team_warps) break;
  }
  return tasks;
}

using Warps = std::array<std::vector<SolveChunk>, team_warps>;

/// Gives the tasks of a level to the warps, the longest first and each to the one with the least to do.
void share_out(std::vector<Task> tasks, int flags, Warps& warps) {
  std::stable_sort(tasks.begin(), tasks.end(),
                   [](const Task& a, const Task& b) { return a.size() > b.size(); });
  std::array<std::size_t, team_warps> before{};
  for (int w = 0; w < team_warps; ++w) before[w] = warps[w].size();
  const auto busy = [&](int w) { return warps[w].size() - before[w]; };
  for (const Task& task : tasks) {
    int least = 0;
    for (int w = 1; w < team_warps; ++w)
      if (busy(w) < busy(least)) least = w;
    warps[least].insert(warps[least].end(), task.begin(), task.end());
  }
  for (int w = 0; w < team_warps; ++w) {
    if (busy(w) == 0) {
      warps[w].emplace_back();
      warps[w].back().flags = flags;
    }
    warps[w].back().flags |= SolveChunk::ends_level;
  }
}

}  // namespace

SolvePlan plan_solve(const FrontPlan& plan) {
  SolvePlan solve;
  std::vector<int> first_gather;
  for (const FrontLayout& front : plan.fronts) {
    first_gather.push_back(static_cast<int>(solve.gathers.size()));
    const int vertices = front.column_count + front.row_count;
    for (int vertex = 0; vertex < vertices; ++vertex) {
      const auto from = [&](int k) {
        if (front.children[k] < 0) return -1;
        const int place = plan.child_rows[front.first_map + k * vertices + vertex];
        return place < 0 ? -1 : plan.fronts[front.children[k]].vector_at + 3 * place;
      };
      solve.gathers.push_back({from(0), from(1)});
    }
  }
  // Copies go by whole chunks, beyond the last one.
  solve.gathers.resize(solve.gathers.size() + column_gathers + row_gathers);
  Warps warps;
  for (const FrontLevel& level : plan.levels) {
    const std::vector<Task> tasks = enough_tasks({chunk_rows, chunk_rows / 2, chunk_rows / 4}, [&](int rows) {
      std::vector<Task> cut;
      for (int f = level.first_front; f < level.first_front + level.front_count; ++f)
        for (int row = 0; row < plan.fronts[f].leading; row += rows)
          cut.push_back(forward_task(plan, plan.fronts[f], first_gather[f], row, rows));
      return cut;
    });
    share_out(tasks, 0, warps);
  }
  for (std::size_t l = plan.levels.size(); l-- > 0;) {
    const FrontLevel& level = plan.levels[l];
    const std::vector<Task> tasks =
        enough_tasks({chunk_columns, 2 * chunk_columns / 3, chunk_columns / 3}, [&](int columns) {
          std::vector<Task> cut;
          for (int f = level.first_front; f < level.first_front + level.front_count; ++f)
            for (int column = 0; column < 3 * plan.fronts[f].column_count; column += columns)
              cut.push_back(backward_task(plan, plan.fronts[f], column, columns));
          return cut;
        });
    share_out(tasks, SolveChunk::backward, warps);
  }
  for (const auto& chunks : warps) {
    solve.starts.push_back(static_cast<int>(solve.chunks.size()));
    solve.chunks.insert(solve.chunks.end(), chunks.begin(), chunks.end());
    solve.chunks.resize(solve.chunks.size() + chunks_ahead);
  }
  solve.starts.push_back(static_cast<int>(solve.chunks.size()));
  return solve;
}

}  // namespace flash::sim::cuda
