#include "sim/cuda/layout/solve_plan.h"

#include <algorithm>
#include <array>
#include <span>

#include "sim/cuda/layout/front_owners.h"
#include "sim/cuda/layout/places.h"

namespace flash::sim::cuda {
namespace {

/// Chunks that add up to one set of results.
struct Task {
  int owner;  ///< front_owners
  std::vector<SolveChunk> chunks;
};

/// The squares of a front's tile that hold numbers, a bit each: own rows up to the diagonal, and those below.
int squares_of_tile(const FrontLayout& front, int row_tile, int column_tile) {
  constexpr int width = solve_tile_width / 2;
  const int own = 3 * front.column_count, end = front.below_at + 3 * front.row_count;
  int squares = 0;
  for (int square = 0; square < tile_squares; ++square) {
    const int row = solve_tile_width * row_tile + width * (square % 2),
              column = solve_tile_width * column_tile + width * (square / 2);
    const bool in_own = row < own && row >= column, below = row + width > front.below_at && row < end;
    if (column < own && (in_own || below)) squares |= 1 << square;
  }
  return squares;
}

/// The tiles of a front from `row` and `column` on, as many as `rows` and `columns` lie in.
void take_tiles(const FrontLayout& front, int row, int rows, int column, int columns, int result_table,
                SolveChunk& chunk) {
  const int r = row / solve_tile_width, c = column / solve_tile_width;
  chunk.first_tile = front.first_tile + r * front.column_tiles + c;
  const bool two_rows = rows > solve_tile_width && r + 1 < front.row_tiles,
             two_columns = columns > solve_tile_width && c + 1 < front.column_tiles;
  int squares = 0;
  for (int i = 0; i <= int{two_rows}; ++i)
    for (int j = 0; j <= int{two_columns}; ++j)
      squares |= squares_of_tile(front, r + i, c + j) << tile_squares * (2 * i + j);
  chunk.rows = chunk_rows(two_rows ? front.column_tiles : 0, squares);
  chunk.columns = chunk_columns(two_columns, result_table);
}

/// A front as a team solves with it.
struct TeamFront {
  const FrontLayout& front;
  int owner;           ///< front_owners
  bool passes_to_all;  ///< whether what it passes up is for all blocks
  int vector_at;       ///< of what it passes up in a forward solve, three numbers a vertex below

  int columns() const { return 3 * front.column_count; }
  int end() const { return front.below_at + 3 * front.row_count; }
};

struct TeamFronts {
  std::vector<TeamFront> fronts;
  int vector_end;  ///< behind what they pass up
};

/// What a front passes up lives until its parent is done. What one block works on has memory of its own,
/// since blocks do not wait for each other there.
std::vector<int> vector_places(const FrontPlan& plan, const std::vector<int>& owners, int team_blocks,
                               int& vector_end) {
  std::vector<Places> places(static_cast<std::size_t>(team_blocks) + 1);
  const auto places_of = [&](std::size_t front) -> Places& {
    return places[static_cast<std::size_t>(owners[front] + 1)];
  };
  const auto size_of = [&](std::size_t front) { return 3L * plan.fronts[front].row_count; };
  std::vector<int> at(plan.fronts.size());
  for (const FrontLevel& level : plan.levels) {
    const auto first = static_cast<std::size_t>(level.first_front),
               end = first + static_cast<std::size_t>(level.front_count);
    for (std::size_t f = first; f < end; ++f) at[f] = static_cast<int>(places_of(f).take(size_of(f)));
    for (std::size_t f = first; f < end; ++f)
      for (const int child : plan.fronts[f].children)
        if (const auto c = static_cast<std::size_t>(child); child >= 0)
          places_of(c).give_back(at[c], size_of(c));
  }
  std::vector<int> begin;
  int next = plan.nothing_passed() + 1;
  for (const Places& own : places) {
    begin.push_back(next);
    next += static_cast<int>(own.total());
  }
  for (std::size_t f = 0; f < at.size(); ++f) at[f] += begin[static_cast<std::size_t>(owners[f] + 1)];
  vector_end = next;
  return at;
}

TeamFronts team_fronts(const FrontPlan& plan, int team_blocks) {
  const std::vector<int> owners = front_owners(plan, team_blocks);
  std::vector<bool> passes_to_all(plan.fronts.size(), false);
  for (std::size_t f = 0; f < plan.fronts.size(); ++f)
    for (const int child : plan.fronts[f].children)
      if (child >= 0) passes_to_all[static_cast<std::size_t>(child)] = owners[f] == all_blocks;
  TeamFronts team;
  const std::vector<int> at = vector_places(plan, owners, team_blocks, team.vector_end);
  for (std::size_t f = 0; f < plan.fronts.size(); ++f)
    team.fronts.push_back({plan.fronts[f], owners[f], passes_to_all[f], at[f]});
  return team;
}

/// What becomes of `rows` rows of a front, from `row` on.
Task forward_task(const FrontPlan& plan, const TeamFront& own, int row, int rows) {
  const FrontLayout& front = own.front;
  const int columns = own.columns();
  // Above the diagonal there are zeros.
  const int end = row + rows > front.below_at ? columns : std::min(columns, row + rows);
  const auto in_chunk = [&](int at) { return std::clamp(at - row, 0, rows); };
  SolveChunk chunk;
  chunk.own_at = 3 * front.first_column + row;
  chunk.own_count = in_chunk(columns);
  chunk.passed_at = own.vector_at - front.below_at + row;
  chunk.passed_begin = in_chunk(front.below_at);
  chunk.passed_end = in_chunk(own.end());
  Task task{own.owner, {}};
  for (int column = 0; column < end; column += chunk_width) {
    const bool last = column + chunk_width >= end;
    chunk.flags = last ? SolveChunk::ends : 0;
    if (own.owner == all_blocks) chunk.flags |= SolveChunk::own_to_all;
    if (own.passes_to_all) chunk.flags |= SolveChunk::passed_to_all;
    chunk.inputs = std::min(chunk_width, end - column);
    chunk.input_table = front.first_entry + column;
    chunk.right_at = 3 * (plan.size + front.first_column) + column;
    take_tiles(front, row, rows, column, chunk.inputs, last ? front.first_entry + row : -1, chunk);
    task.chunks.push_back(chunk);
  }
  return task;
}

/// The solution of `columns` columns of a front, from `column` on, for all blocks. `entries`:
/// SolvePlan::entries.
Task backward_task(const FrontPlan& plan, int entries, const TeamFront& own, int column, int columns) {
  const FrontLayout& front = own.front;
  SolveChunk chunk;
  chunk.own_at = 3 * (plan.size + front.first_column) + column;
  chunk.own_count = std::min(columns, own.columns() - column);
  Task task{own.owner, {}};
  // Above the diagonal there are zeros.
  for (int row = column; row < own.end(); row += chunk_width) {
    chunk.flags = SolveChunk::own_to_all | (row + chunk_width >= own.end() ? SolveChunk::ends : 0);
    chunk.inputs = std::min(chunk_width, own.end() - row);
    chunk.input_table = entries + front.first_entry + row;
    take_tiles(front, row, chunk.inputs, column, columns, -1, chunk);
    task.chunks.push_back(chunk);
  }
  return task;
}

using Shares = std::vector<std::vector<SolveChunk>>;  ///< of each warp of a team, by turns of its blocks

/// A level's tasks for each warp: those of one block first, and the longest first, each to the warp with the
/// least to do.
Shares share_out(std::vector<Task> tasks, int team_blocks) {
  std::stable_sort(tasks.begin(), tasks.end(), [](const Task& a, const Task& b) {
    const bool a_shared = a.owner == all_blocks, b_shared = b.owner == all_blocks;
    return a_shared != b_shared ? b_shared : a.chunks.size() > b.chunks.size();
  });
  Shares shares(static_cast<std::size_t>(block_warps * team_blocks));
  for (const Task& task : tasks) {
    const bool shared = task.owner == all_blocks;
    const auto step = static_cast<std::size_t>(shared ? 1 : team_blocks);
    auto least = static_cast<std::size_t>(shared ? 0 : task.owner);
    for (std::size_t w = least; w < shares.size(); w += step)
      if (shares[w].size() < shares[least].size()) least = w;
    shares[least].insert(shares[least].end(), task.chunks.begin(), task.chunks.end());
  }
  return shares;
}

/// Numbers whose sum comes in two parts.
class Parts {
 public:
  /// `first`: where second parts may stand.
  Parts(const FrontPlan& plan, int first)
      : none_(plan.nothing_passed()), next_(first), second_(static_cast<std::size_t>(none_), none_) {}

  /// Where the other parts of `count` numbers from `at` on stand.
  int take(int at, int count) {
    const int first = next_;
    for (int k = 0; k < count; ++k) second_[static_cast<std::size_t>(at + k)] = next_++;
    return first;
  }
  /// The other part of a number, nothing_passed where it comes in one.
  int second(int at) const { return second_[static_cast<std::size_t>(at)]; }
  int end() const { return next_; }

 private:
  int none_, next_;
  std::vector<int> second_;
};

/// The two halves of a task, of which no result is passed up. Each adds up a part of the results, so that two
/// warps can work on them at the same time.
std::array<Task, 2> halves(const Task& task, Parts& parts) {
  const auto middle = task.chunks.begin() + (std::ssize(task.chunks) + 1) / 2;
  std::array<Task, 2> half = {Task{task.owner, {task.chunks.begin(), middle}},
                              Task{task.owner, {middle, task.chunks.end()}}};
  half[0].chunks.back().flags |= SolveChunk::ends;
  const SolveChunk& end = task.chunks.back();
  const int second = parts.take(end.own_at, end.own_count);
  for (SolveChunk& chunk : half[1].chunks) chunk.own_at = second;
  return half;
}

std::size_t longest(const Shares& shares) {
  std::size_t most = 0;
  for (const auto& share : shares) most = std::max(most, share.size());
  return most;
}

/// As if one block worked on them.
std::vector<Task> of_one_block(std::vector<Task> tasks) {
  for (Task& task : tasks) task.owner = 0;
  return tasks;
}

/// Long tasks become halves where one takes half as long as the warps of one block have work, or longer: the
/// more blocks there are, the more they wait for it.
std::vector<Task> with_halves(const std::vector<Task>& tasks, Parts& parts) {
  constexpr std::size_t long_task = chunks_together + 1;
  std::size_t most = 0, all_chunks = 0;
  for (const Task& task : tasks) {
    most = std::max(most, task.chunks.size());
    all_chunks += task.chunks.size();
  }
  if (most < long_task || 2 * most * block_warps < all_chunks) return tasks;
  std::vector<Task> all;
  for (const Task& task : tasks) {
    const SolveChunk& end = task.chunks.back();
    if (task.chunks.size() >= long_task && end.passed_begin >= end.passed_end) {
      for (Task& half : halves(task, parts)) all.push_back(std::move(half));
    } else {
      all.push_back(task);
    }
  }
  return all;
}

/// Adds a level in tasks of whichever width has the warps of one block wait least for each other: for any
/// team the same, since chunks of other columns are rounded otherwise. `next_is_shared`: as in SolveChunk.
template <typename Cut>
void add_level(const Cut& cut, int team_blocks, bool next_is_shared, Parts& parts, Shares& warps) {
  const auto most = [&](int width) { return longest(share_out(of_one_block(cut(width)), 1)); };
  const int width = most(solve_tile_width) < most(chunk_width) ? solve_tile_width : chunk_width;
  Shares shares = share_out(with_halves(cut(width), parts), team_blocks);
  for (std::size_t w = 0; w < warps.size(); ++w) {
    while (shares[w].empty() || shares[w].size() % chunks_together != 0) shares[w].emplace_back();
    shares[w].back().flags |= SolveChunk::ends_level | (next_is_shared ? SolveChunk::next_is_shared : 0);
    warps[w].insert(warps[w].end(), shares[w].begin(), shares[w].end());
  }
}

std::vector<Gather> gathers_of(const FrontPlan& plan, const TeamFronts& team, const Parts& parts) {
  const int none = plan.nothing_passed(), rows = static_cast<int>(plan.entries.size());
  // Copies go by whole chunks, beyond the last row.
  std::vector<Gather> gathers(2 * plan.entries.size() + chunk_width, {none, none});
  // Padding has zeros, which the scale of a chunk does not follow.
  for (int row = 0; row < rows; ++row)
    if (const int entry = plan.entries[row]; entry >= 0) gathers[rows + row] = {entry, parts.second(entry)};
  for (const FrontLayout& front : plan.fronts) {
    const int vertices = front.column_count + front.row_count, columns = 3 * front.column_count;
    for (int entry = 0; entry < 3 * vertices; ++entry) {
      const auto from = [&](int k) {
        if (front.children[k] < 0) return none;
        const int place = plan.child_rows[front.first_map + k * vertices + entry / 3];
        return place < 0 ? none : team.fronts[front.children[k]].vector_at + 3 * place + entry % 3;
      };
      const int row = entry < columns ? entry : front.below_at + entry - columns;
      gathers[front.first_entry + row] = {from(0), from(1)};
    }
  }
  return gathers;
}

}  // namespace

SolvePlan plan_solve(const FrontPlan& plan, int team_blocks) {
  const TeamFronts team = team_fronts(plan, team_blocks);
  SolvePlan solve;
  Parts parts(plan, team.vector_end);
  solve.entries = static_cast<int>(plan.entries.size());
  const auto fronts_of = [&](std::size_t level) {
    return std::span(team.fronts)
        .subspan(static_cast<std::size_t>(plan.levels[level].first_front),
                 static_cast<std::size_t>(plan.levels[level].front_count));
  };
  const auto is_shared = [&](std::size_t level) {
    const auto fronts = fronts_of(level);
    return std::any_of(fronts.begin(), fronts.end(),
                       [](const TeamFront& f) { return f.owner == all_blocks; });
  };
  const std::size_t levels = plan.levels.size();
  Shares warps(static_cast<std::size_t>(block_warps * team_blocks));
  for (std::size_t l = 0; l < levels; ++l)
    add_level(
        [&](int rows) {
          std::vector<Task> tasks;
          for (const TeamFront& front : fronts_of(l))
            for (int row = 0; row < front.end(); row += rows)
              tasks.push_back(forward_task(plan, front, row, rows));
          return tasks;
        },
        team_blocks, l + 1 == levels || is_shared(l) || is_shared(l + 1), parts, warps);
  for (std::size_t l = levels; l-- > 0;)
    add_level(
        [&](int columns) {
          std::vector<Task> tasks;
          for (const TeamFront& front : fronts_of(l))
            for (int column = 0; column < front.columns(); column += columns)
              tasks.push_back(backward_task(plan, solve.entries, front, column, columns));
          return tasks;
        },
        team_blocks, l == 0 || is_shared(l), parts, warps);
  solve.gathers = gathers_of(plan, team, parts);
  for (int at = 3 * plan.size; at < 6 * plan.size; ++at)
    if (parts.second(at) != plan.nothing_passed()) solve.parted.push_back({at, parts.second(at)});
  solve.vector_size = parts.end() + 2 * solve_tile_width;  // chunks read beyond the last number
  for (const auto& chunks : warps) {
    solve.starts.push_back(static_cast<int>(solve.chunks.size()));
    solve.chunks.insert(solve.chunks.end(), chunks.begin(), chunks.end());
    solve.chunks.resize(solve.chunks.size() + chunks_ahead);
  }
  solve.starts.push_back(static_cast<int>(solve.chunks.size()));
  return solve;
}

}  // namespace flash::sim::cuda
