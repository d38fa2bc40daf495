#include "sim/cuda/layout/solve_plan.h"

#include <algorithm>

namespace flash::sim::cuda {
namespace {

using Task = std::vector<SolveChunk>;  ///< chunks that add up to one set of results

/// The tiles of a front from `row` and `column` on, as many as `rows` and `columns` lie in.
void take_tiles(const FrontLayout& front, int row, int rows, int column, int columns, int result_table,
                SolveChunk& chunk) {
  const int r = row / solve_tile_width, c = column / solve_tile_width;
  chunk.first_tile = front.first_tile + r * front.column_tiles + c;
  chunk.next_row = rows > solve_tile_width && r + 1 < front.row_tiles ? front.column_tiles : 0;
  chunk.columns = chunk_columns(columns > solve_tile_width && c + 1 < front.column_tiles, result_table);
}

/// What becomes of `rows` rows of a front, from `row` on.
Task forward_task(const FrontPlan& plan, const FrontLayout& front, int row, int rows) {
  const int columns = 3 * front.column_count, below = 3 * front.row_count;
  // Above the diagonal there are zeros.
  const int end = row + rows > front.below_at ? columns : std::min(columns, row + rows);
  const auto in_chunk = [&](int at) { return std::clamp(at - row, 0, rows); };
  SolveChunk chunk;
  chunk.own_at = 3 * front.first_column + row;
  chunk.own_count = in_chunk(columns);
  chunk.passed_at = front.vector_at - front.below_at + row;
  chunk.passed_begin = in_chunk(front.below_at);
  chunk.passed_end = in_chunk(front.below_at + below);
  Task task;
  for (int column = 0; column < end; column += chunk_width) {
    const bool last = column + chunk_width >= end;
    chunk.flags = last ? SolveChunk::ends : 0;
    chunk.inputs = std::min(chunk_width, end - column);
    chunk.input_table = front.first_entry + column;
    chunk.right_at = 3 * (plan.size + front.first_column) + column;
    take_tiles(front, row, rows, column, chunk.inputs, last ? front.first_entry + row : -1, chunk);
    task.push_back(chunk);
  }
  return task;
}

/// The solution of `columns` columns of a front, from `column` on. `entries`: SolvePlan::entries.
Task backward_task(const FrontPlan& plan, int entries, const FrontLayout& front, int column, int columns) {
  const int end = front.below_at + 3 * front.row_count;
  SolveChunk chunk;
  chunk.own_at = 3 * (plan.size + front.first_column) + column;
  chunk.own_count = std::min(columns, 3 * front.column_count - column);
  Task task;
  // Above the diagonal there are zeros.
  for (int row = column; row < end; row += chunk_width) {
    chunk.flags = row + chunk_width >= end ? SolveChunk::ends : 0;
    chunk.inputs = std::min(chunk_width, end - row);
    chunk.input_table = entries + front.first_entry + row;
    take_tiles(front, row, chunk.inputs, column, columns, -1, chunk);
    task.push_back(chunk);
  }
  return task;
}

using Shares = std::vector<std::vector<SolveChunk>>;  ///< of each warp

/// A level's tasks for each warp: the longest first, each to the warp with the least to do.
Shares share_out(std::vector<Task> tasks, std::size_t warps) {
  std::stable_sort(tasks.begin(), tasks.end(),
                   [](const Task& a, const Task& b) { return a.size() > b.size(); });
  Shares shares(warps);
  for (const Task& task : tasks) {
    const auto least = std::min_element(shares.begin(), shares.end(),
                                        [](const auto& a, const auto& b) { return a.size() < b.size(); });
    least->insert(least->end(), task.begin(), task.end());
  }
  return shares;
}

std::size_t longest(const Shares& shares) {
  std::size_t most = 0;
  for (const auto& share : shares) most = std::max(most, share.size());
  return most;
}

/// Adds a level in tasks of whichever width has the warps of one block wait least for each other: for any
/// team the same, since chunks of other columns are rounded otherwise.
template <typename Cut>
void add_level(const Cut& cut, Shares& warps) {
  const auto most = [&](int width) { return longest(share_out(cut(width), block_warps)); };
  const int width = most(solve_tile_width) < most(chunk_width) ? solve_tile_width : chunk_width;
  Shares shares = share_out(cut(width), warps.size());
  for (std::size_t w = 0; w < warps.size(); ++w) {
    while (shares[w].empty() || shares[w].size() % chunks_together != 0) shares[w].emplace_back();
    shares[w].back().flags |= SolveChunk::ends_level;
    warps[w].insert(warps[w].end(), shares[w].begin(), shares[w].end());
  }
}

std::vector<Gather> gathers_of(const FrontPlan& plan) {
  const int none = plan.nothing_passed(), rows = static_cast<int>(plan.entries.size());
  // Copies go by whole chunks, beyond the last row.
  std::vector<Gather> gathers(2 * plan.entries.size() + chunk_width, {none, none});
  for (int row = 0; row < rows; ++row) gathers[rows + row].first = plan.entries[row];
  for (const FrontLayout& front : plan.fronts) {
    const int vertices = front.column_count + front.row_count, columns = 3 * front.column_count;
    for (int entry = 0; entry < 3 * vertices; ++entry) {
      const auto from = [&](int k) {
        if (front.children[k] < 0) return none;
        const int place = plan.child_rows[front.first_map + k * vertices + entry / 3];
        return place < 0 ? none : plan.fronts[front.children[k]].vector_at + 3 * place + entry % 3;
      };
      const int row = entry < columns ? entry : front.below_at + entry - columns;
      gathers[front.first_entry + row] = {from(0), from(1)};
    }
  }
  return gathers;
}

}  // namespace

SolvePlan plan_solve(const FrontPlan& plan, int warps_of_team) {
  SolvePlan solve;
  solve.gathers = gathers_of(plan);
  solve.entries = static_cast<int>(plan.entries.size());
  Shares warps(static_cast<std::size_t>(warps_of_team));
  for (const FrontLevel& level : plan.levels)
    add_level(
        [&](int rows) {
          std::vector<Task> tasks;
          for (int f = level.first_front; f < level.first_front + level.front_count; ++f)
            for (int row = 0; row < plan.fronts[f].below_at + 3 * plan.fronts[f].row_count; row += rows)
              tasks.push_back(forward_task(plan, plan.fronts[f], row, rows));
          return tasks;
        },
        warps);
  for (std::size_t l = plan.levels.size(); l-- > 0;) {
    const FrontLevel& level = plan.levels[l];
    add_level(
        [&](int columns) {
          std::vector<Task> tasks;
          for (int f = level.first_front; f < level.first_front + level.front_count; ++f)
            for (int column = 0; column < 3 * plan.fronts[f].column_count; column += columns)
              tasks.push_back(backward_task(plan, solve.entries, plan.fronts[f], column, columns));
          return tasks;
        },
        warps);
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
