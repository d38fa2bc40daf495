#include "sim/cuda/layout/solve_plan.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
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

/// A team at its chunks, as front_solve.cuh: the warps of a level in the order told.
Eigen::VectorXd solve_by_chunks(const FrontPlan& plan, const SolvePlan& solve,
                                const std::vector<Eigen::MatrixXd>& columns, const Eigen::VectorXd& right,
                                const std::vector<int>& order) {
  constexpr int w = solve_tile_width;
  std::vector<Eigen::MatrixXd> tiles(plan.factor_tiles);
  for (std::size_t f = 0; f < plan.fronts.size(); ++f)
    for (int r = 0; r < plan.fronts[f].row_tiles; ++r)
      for (int c = 0; c < plan.fronts[f].column_tiles; ++c)
        tiles[plan.fronts[f].first_tile + r * plan.fronts[f].column_tiles + c] =
            columns[f].block<w, w>(w * r, w * c);
  // Of a tile that is not read stands anything.
  const Eigen::MatrixXd anything = Eigen::MatrixXd::Constant(w, w, 1e3);
  std::vector<double> vector(plan.vector_size, 1e3);
  vector[plan.nothing_passed()] = 0;
  std::copy(right.begin(), right.end(), vector.begin() + right.size());
  std::vector<int> next(solve.starts.begin(), solve.starts.end() - 1);
  for (std::size_t level = 0; level < 2 * plan.levels.size(); ++level)
    for (const int warp : order) {
      const bool backward = level >= plan.levels.size();
      Eigen::VectorXd sum = Eigen::VectorXd::Zero(chunk_width);
      for (bool more = true; more;) {
        const SolveChunk& chunk = solve.chunks[next[warp]++];
        more = (chunk.flags & SolveChunk::ends_level) == 0;
        if (chunk.inputs == 0) continue;
        Eigen::VectorXd inputs = Eigen::VectorXd::Zero(chunk_width);
        for (int k = 0; k < chunk.inputs; ++k) {
          const int at = chunk.input_table + k;
          inputs[k] = backward ? vector[solve.gathers[at].first]
                               : vector[chunk.right_at + k] + vector[solve.gathers[at].first] +
                                     vector[solve.gathers[at].second];
        }
        for (int row = 0; row < 2; ++row)
          for (int column = 0; column < 2; ++column) {
            const int input = backward ? row : column, result = backward ? column : row;
            if (input == 1 && chunk.inputs <= w) continue;
            const bool read = (row == 0 || chunk.next_row > 0) && (column == 0 || chunk.columns % 2 != 0);
            Eigen::MatrixXd left = read ? tiles[chunk.first_tile + row * chunk.next_row + column] : anything;
            if (backward) left.transposeInPlace();
            sum.segment<w>(result * w) += left * inputs.segment<w>(input * w);
          }
        if ((chunk.flags & SolveChunk::ends) == 0) continue;
        for (int r = 0; r < chunk_width; ++r) {
          if (r < chunk.own_count) {
            vector[chunk.own_at + r] = sum[r];
          } else if (r >= chunk.passed_begin && r < chunk.passed_end) {
            const Gather& gather = solve.gathers[chunk.columns / 2 + r];
            vector[chunk.passed_at + r] = sum[r] + vector[gather.first] + vector[gather.second];
          }
        }
        sum.setZero();
      }
    }
  return Eigen::Map<const Eigen::VectorXd>(vector.data() + right.size(), right.size());
}

TEST(SolvePlan, ItsChunksComeToTheSolveInWhateverOrderWarpsTakeThem) {
  for (const auto& [name, sheet] : small_plans()) {
    SCOPED_TRACE(name);
    for (const int leaf_size : {3, 8, 12}) {
      const FrontPlan fronts = plan_fronts(sheet->pattern, sheet->sheet.rest.vertices,
                                           {.leaf_size = leaf_size, .panel_capacity = 12 * 1024});
      for (const int warps : {block_warps, 8 * block_warps}) {
        const SolvePlan solve = plan_solve(fronts, warps);
        const std::vector<Eigen::MatrixXd> columns = random_columns(fronts);
        const Eigen::VectorXd right = Eigen::VectorXd::LinSpaced(3L * fronts.size, -1, 2);
        std::vector<int> order(static_cast<std::size_t>(warps));
        std::iota(order.begin(), order.end(), 0);
        const Eigen::VectorXd x = solve_by_chunks(fronts, solve, columns, right, order);
        std::reverse(order.begin(), order.end());
        EXPECT_EQ(x, solve_by_chunks(fronts, solve, columns, right, order));
        const Eigen::VectorXd expected = solve_by_fronts(fronts, columns, right);
        EXPECT_LE((x - expected).norm(), 1e-10 * expected.norm());
      }
    }
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
