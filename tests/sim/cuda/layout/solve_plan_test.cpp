#include "sim/cuda/layout/solve_plan.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <limits>
#include <numeric>
#include <random>

#include "tests/sim/cuda/meshes.h"

namespace flash::sim::cuda {
namespace {

/// The columns W of each front, with its own rows and those below it as in the factor, at random.
std::vector<Eigen::MatrixXd> random_columns(const FrontPlan& plan) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> number(-1, 1);
  std::vector<Eigen::MatrixXd> columns;
  for (const FrontLayout& front : plan.fronts) {
    const int own = 3 * front.column_count;
    Eigen::MatrixXd w =
        Eigen::MatrixXd::Zero(solve_tile_width * front.row_tiles, solve_tile_width * front.column_tiles);
    for (int c = 0; c < own; ++c) {
      for (int r = c; r < own; ++r) w(r, c) = number(random);
      for (int r = 0; r < 3 * front.row_count; ++r) w(front.below_at + r, c) = number(random);
    }
    columns.push_back(std::move(w));
  }
  return columns;
}

/// What the fronts' columns come to one after the other: by the rows below each as they stand in the matrix.
Eigen::VectorXd solve_by_fronts(const FrontPlan& plan, const std::vector<Eigen::MatrixXd>& columns,
                                const Eigen::VectorXd& right) {
  const auto rows_below = [&](const FrontLayout& front) {
    std::vector<int> rows;
    for (int r = 0; r < front.row_count; ++r)
      for (int c = 0; c < 3; ++c) rows.push_back(3 * plan.rows[front.first_row + r] + c);
    return rows;
  };
  Eigen::VectorXd rest = right, y(right.size()), x(right.size());
  for (std::size_t f = 0; f < plan.fronts.size(); ++f) {
    const FrontLayout& front = plan.fronts[f];
    const int own = 3 * front.column_count, first = 3 * front.first_column;
    const std::vector<int> below = rows_below(front);
    const Eigen::VectorXd b = rest.segment(first, own);
    y.segment(first, own) = columns[f].topLeftCorner(own, own) * b;
    rest(below) += columns[f].block(front.below_at, 0, static_cast<Eigen::Index>(below.size()), own) * b;
  }
  for (std::size_t f = plan.fronts.size(); f-- > 0;) {
    const FrontLayout& front = plan.fronts[f];
    const int own = 3 * front.column_count, first = 3 * front.first_column;
    const std::vector<int> below = rows_below(front);
    x.segment(first, own) =
        columns[f].topLeftCorner(own, own).transpose() * y.segment(first, own) +
        columns[f].block(front.below_at, 0, static_cast<Eigen::Index>(below.size()), own).transpose() *
            x(below);
  }
  return x;
}

/// A number that a block has written for the others, which see it once the team has waited for all.
struct Sent {
  int at;
  double number;
};

/// A team at its chunks, as front_solve.cuh: each block has a vector of its own, and the blocks of a team go
/// one after the other, in the order told, up to where they need of each other what they have. The warps of a
/// block go in that order too.
class Team {
 public:
  Team(const FrontPlan& plan, const SolvePlan& solve, const std::vector<Eigen::MatrixXd>& columns,
       const Eigen::VectorXd& right, int blocks, bool reversed, bool at_once = false)
      : plan_(plan),
        solve_(solve),
        blocks_(blocks),
        reversed_(reversed),
        at_once_(at_once),
        tiles_(plan.factor_tiles) {
    constexpr int w = solve_tile_width;
    for (std::size_t f = 0; f < plan.fronts.size(); ++f)
      for (int r = 0; r < plan.fronts[f].row_tiles; ++r)
        for (int c = 0; c < plan.fronts[f].column_tiles; ++c)
          tiles_[plan.fronts[f].first_tile + r * plan.fronts[f].column_tiles + c] =
              columns[f].block<w, w>(w * r, w * c);
    // What a block has not been told is no number.
    std::vector<double> vector(solve.vector_size, std::numeric_limits<double>::quiet_NaN());
    vector[plan.nothing_passed()] = 0;
    std::copy(right.begin(), right.end(), vector.begin() + right.size());
    vectors_.assign(blocks, vector);
    next_.assign(solve.starts.begin(), solve.starts.end() - 1);
    levels_.assign(blocks, 0);
  }

  /// The solutions that the blocks come to.
  std::vector<Eigen::VectorXd> solve() {
    const int end = static_cast<int>(2 * plan_.levels.size());
    while (levels_.front() < end) {
      for (const int block : in_order(blocks_))
        while (!run_level(block) && levels_[block] < end) {
        }
      for (const Sent& sent : sent_)
        for (auto& vector : vectors_) vector[sent.at] = sent.number;
      sent_.clear();
    }
    std::vector<Eigen::VectorXd> solutions;
    const Eigen::Index size = 3L * plan_.size;
    for (auto& vector : vectors_)
      for (const Gather& parts : solve_.parted) vector[parts.first] += vector[parts.second];
    for (const auto& vector : vectors_)
      solutions.emplace_back(Eigen::Map<const Eigen::VectorXd>(vector.data() + size, size));
    return solutions;
  }

 private:
  std::vector<int> in_order(int count) const {
    std::vector<int> order(count);
    std::iota(order.begin(), order.end(), 0);
    if (reversed_) std::reverse(order.begin(), order.end());
    return order;
  }

  /// Returns whether the team waits for all behind it.
  bool run_level(int block) {
    int flags = 0;
    for (const int warp : in_order(block_warps)) flags = run_warp(block, warp * blocks_ + block);
    ++levels_[block];
    return (flags & SolveChunk::next_is_shared) != 0 || levels_[block] == std::ssize(plan_.levels);
  }

  int run_warp(int block, int warp) {
    constexpr int w = solve_tile_width;
    const bool backward = levels_[block] >= std::ssize(plan_.levels);
    std::vector<double>& vector = vectors_[block];
    // Of a tile that is not read stands anything.
    const Eigen::MatrixXd anything = Eigen::MatrixXd::Constant(w, w, 1e3);
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(chunk_width);
    while (true) {
      const SolveChunk& chunk = solve_.chunks[next_[warp]++];
      EXPECT_EQ(chunk.inputs > 0, squares_of(chunk.rows) != 0);
      Eigen::VectorXd inputs = Eigen::VectorXd::Zero(chunk_width);
      for (int k = 0; k < chunk.inputs; ++k) {
        const int at = chunk.input_table + k;
        inputs[k] = vector[solve_.gathers[at].first] + vector[solve_.gathers[at].second];
        if (!backward) inputs[k] += vector[chunk.right_at + k];
      }
      for (int row = 0; row < 2 && chunk.inputs > 0; ++row)
        for (int column = 0; column < 2; ++column) {
          const int input = backward ? row : column, result = backward ? column : row;
          if (input == 1 && chunk.inputs <= w) continue;
          const int next_row = next_row_of(chunk.rows);
          const bool read = (row == 0 || next_row > 0) && (column == 0 || chunk.columns % 2 != 0);
          Eigen::MatrixXd left = read ? tiles_[chunk.first_tile + row * next_row + column] : anything;
          for (int square = 0; square < tile_squares && read; ++square)
            if ((squares_of(chunk.rows) >> (tile_squares * (2 * row + column) + square) & 1) == 0)
              left.block<w / 2, w / 2>(w / 2 * (square % 2), w / 2 * (square / 2)).setZero();
          if (backward) left.transposeInPlace();
          sum.segment<w>(result * w) += left * inputs.segment<w>(input * w);
        }
      if (chunk.inputs > 0 && (chunk.flags & SolveChunk::ends) != 0) {
        finish(chunk, block, sum);
        sum.setZero();
      }
      if ((chunk.flags & SolveChunk::ends_level) != 0) return chunk.flags;
    }
  }

  void finish(const SolveChunk& chunk, int block, const Eigen::VectorXd& sum) {
    std::vector<double>& vector = vectors_[block];
    const auto set = [&](int at, double number, bool to_all) {
      vector[at] = number;
      if (to_all && at_once_)
        for (auto& other : vectors_) other[at] = number;
      else if (to_all)
        sent_.push_back({at, number});
    };
    for (int r = 0; r < chunk_width; ++r) {
      if (r < chunk.own_count) {
        set(chunk.own_at + r, sum[r], chunk.flags & SolveChunk::own_to_all);
      } else if (r >= chunk.passed_begin && r < chunk.passed_end) {
        const Gather& gather = solve_.gathers[chunk.columns / 2 + r];
        set(chunk.passed_at + r, sum[r] + vector[gather.first] + vector[gather.second],
            chunk.flags & SolveChunk::passed_to_all);
      }
    }
  }

  const FrontPlan& plan_;
  const SolvePlan& solve_;
  int blocks_;
  bool reversed_;
  bool at_once_;  ///< what a block writes for the others they see at once, as they may
  std::vector<Eigen::MatrixXd> tiles_;
  std::vector<std::vector<double>> vectors_;  ///< of each block
  std::vector<int> next_;                     ///< chunk of each warp
  std::vector<int> levels_;                   ///< of each block
  std::vector<Sent> sent_;
};

TEST(SolvePlan, ItsChunksComeToTheSolveInWhateverOrderWarpsTakeThem) {
  for (const auto& [name, sheet] : small_plans()) {
    SCOPED_TRACE(name);
    for (const int leaf_size : {3, 8, 12}) {
      const FrontPlan fronts = plan_fronts(sheet->pattern, sheet->sheet.rest.vertices,
                                           {.leaf_size = leaf_size, .panel_capacity = 12 * 1024});
      const std::vector<Eigen::MatrixXd> columns = random_columns(fronts);
      const Eigen::VectorXd right = Eigen::VectorXd::LinSpaced(3L * fronts.size, -1, 2);
      const Eigen::VectorXd expected = solve_by_fronts(fronts, columns, right);
      const Eigen::VectorXd of_one = Team(fronts, plan_solve(fronts), columns, right, 1, false).solve()[0];
      EXPECT_LE((of_one - expected).norm(), 1e-10 * expected.norm());
      for (const int blocks : {1, 2, 4, 8}) {
        const SolvePlan solve = plan_solve(fronts, blocks);
        for (const bool reversed : {false, true})
          for (const bool at_once : {false, true})
            for (const auto& x : Team(fronts, solve, columns, right, blocks, reversed, at_once).solve())
              EXPECT_EQ(x, of_one);
      }
    }
  }
}

/// Of a team's heights, upwards and downwards, those behind which all blocks wait for each other.
std::vector<bool> shared_heights(const SolvePlan& solve) {
  std::vector<bool> shared;
  for (int k = solve.starts[0]; k < solve.starts[1]; ++k) {
    const int flags = solve.chunks[static_cast<std::size_t>(k)].flags;
    if (flags & SolveChunk::ends_level) shared.push_back((flags & SolveChunk::next_is_shared) != 0);
  }
  return shared;
}

TEST(SolvePlan, AllBlocksWaitAtTheRootAndForTheSolution) {
  for (const auto& [name, sheet] : small_plans()) {
    SCOPED_TRACE(name);
    const FrontPlan fronts = plan_fronts(sheet->pattern, sheet->sheet.rest.vertices);
    const std::vector<bool> shared = shared_heights(plan_solve(fronts, 8));
    ASSERT_EQ(shared.size(), 2 * fronts.levels.size());
    EXPECT_TRUE(shared[fronts.levels.size() - 1]);
    EXPECT_TRUE(shared.back());
  }
}

TEST(SolvePlan, SomeHeightsNeedOneBlockAlone) {
  const auto sheet = make_sheet_plan(
      make_sheet(data::rectangle({.width = 0.4, .height = 0.4, .cells_x = 31, .cells_y = 31})));
  const FrontPlan fronts = plan_fronts(sheet->pattern, sheet->sheet.rest.vertices);
  for (const int blocks : {2, 4, 8}) {
    const std::vector<bool> shared = shared_heights(plan_solve(fronts, blocks));
    // Both ways, beside the ends.
    const auto way = [&](std::size_t first) {
      const auto begin = shared.begin() + static_cast<std::ptrdiff_t>(first);
      return std::count(begin, begin + std::ssize(fronts.levels) - 1, false);
    };
    EXPECT_GT(way(0), 0) << blocks;
    EXPECT_GT(way(fronts.levels.size()), 0) << blocks;
  }
}

TEST(SolvePlan, EachWarpEndsWithChunksToLookAheadTo) {
  for (const auto& [name, sheet] : small_plans()) {
    SCOPED_TRACE(name);
    const SolvePlan solve = plan_solve(plan_fronts(sheet->pattern, sheet->sheet.rest.vertices));
    ASSERT_EQ(solve.starts.size(), std::size_t{block_warps} + 1);
    for (std::size_t w = 1; w <= block_warps; ++w)
      for (int k = 1; k <= chunks_ahead; ++k)
        EXPECT_EQ(solve.chunks[static_cast<std::size_t>(solve.starts[w] - k)].inputs, 0);
  }
}

}  // namespace
}  // namespace flash::sim::cuda
