#pragma once
#include "sim/cuda/front_tables.h"
#include "sim/cuda/stored.cuh"
#include "sim/cuda/team.cuh"

namespace flash::sim::cuda {

// The multifrontal Cholesky factorization of one environment by a team (Duff and Reid 1983; Liu 1992). A
// group of warps owns a front: its columns [A11; A21] stand on chip, in panels of twelve columns, and become
// W = [L11^-1; -L21 L11^-1] in place; its update matrix goes to memory, once. Four barriers for twelve
// columns. Bytes: blocks and factor once, lower update matrices out and in.

/// On-chip numbers of a factorization: the panels of a level, where their rows stand in the children's update
/// matrices, and the inverse of a diagonal block a group.
__host__ __device__ inline int factor_memory(int shared_panel, int shared_rows) {
  return shared_panel + 2 * shared_rows + team_warps * panel_width * panel_width;
}

/// What a front takes from one of its children, if there is one.
struct Passed {
  const float* update;  ///< null without the child
  int leading;
  const int* rows;  ///< place of each of the front's rows in it, -1 where it has none; on chip

  __device__ float at(int row, int column) const {
    // Without a branch, so that many loads are under way: what is not there is read from the start.
    const bool there = row >= 0 && column >= 0;
    const float number = update[there ? column * leading + row : 0];
    return there ? number : 0.0f;
  }
};

/// A front on chip.
struct Panel {
  float* numbers;
  float* inverse;  ///< of the diagonal block at work, row by row
  int leading, columns;
  Group group;
  Passed passed[2];

  __device__ float& at(int row, int column) const { return numbers[column * leading + row]; }
  __device__ float4 four(int row, int column) const {
    return *reinterpret_cast<const float4*>(numbers + column * leading + row);
  }
  __device__ void set_four(int row, int column, const float4& value) const {
    *reinterpret_cast<float4*>(numbers + column * leading + row) = value;
  }
};

/// Where the rows of a front stand in its children.
__device__ inline void find_rows(const FrontTables& tables, const FrontLayout& front, const Panel& panel,
                                 int* rows) {
  const int vertices = front.column_count + front.row_count;
  for (int i = panel.group.rank; i < 2 * front.leading; i += panel.group.size) {
    const int k = i >= front.leading, row = i - k * front.leading, below = row - front.below_at;
    const bool own = row < panel.columns;
    int place = -1;
    if (front.children[k] >= 0 && (own || (below >= 0 && below < 3 * front.row_count))) {
      const int entry = own ? row : panel.columns + below, vertex = entry / 3;
      place = tables.child_rows[front.first_map + k * vertices + vertex];
      if (place >= 0) place = 3 * place + entry - 3 * vertex;
    }
    rows[i] = place;
  }
}

/// Own columns: what the children pass up, and the blocks of the matrix.
__device__ __noinline__ void assemble_columns(const FrontTables& tables, const FrontLayout& front,
                                              const float* __restrict__ blocks, const Panel& shared) {
  const Panel panel = shared;
  constexpr int together = 12;  // columns whose numbers are under way
  for (int row = panel.group.rank; row < front.leading; row += panel.group.size) {
    for (int first = 0; first < panel.columns; first += together) {
      float sums[together] = {};
#pragma unroll
      for (int k = 0; k < 2; ++k) {
        if (panel.passed[k].update == nullptr) continue;
        const int from = panel.passed[k].rows[row];
#pragma unroll
        for (int j = 0; j < together; ++j) {
          const int column = min(first + j, panel.columns - 1);
          sums[j] += panel.passed[k].at(row >= column ? from : -1, panel.passed[k].rows[column]);
        }
      }
#pragma unroll
      for (int j = 0; j < together; ++j)
        if (first + j < panel.columns) panel.at(row, first + j) = sums[j];
    }
  }
  panel.group.synchronize();
  // A column of a block each, a few of them at a time.
  constexpr int blocks_together = 4;
  const int count = 3 * front.block_count;
  for (int base = panel.group.rank; base < count; base += blocks_together * panel.group.size) {
    BlockPlace places[blocks_together];
    float numbers[blocks_together][3];
#pragma unroll
    for (int i = 0; i < blocks_together; ++i)
      places[i] = tables.blocks[front.first_block + min(base + i * panel.group.size, count - 1) / 3];
#pragma unroll
    for (int i = 0; i < blocks_together; ++i) {
      const int c = min(base + i * panel.group.size, count - 1) % 3;
#pragma unroll
      for (int r = 0; r < 3; ++r)
        numbers[i][r] = blocks[9L * places[i].source + (places[i].transposed ? 3 * r + c : 3 * c + r)];
    }
#pragma unroll
    for (int i = 0; i < blocks_together; ++i) {
      const int e = base + i * panel.group.size, column = 3 * places[i].column + e % 3;
      const int row = places[i].row < front.column_count
                          ? 3 * places[i].row
                          : front.below_at + 3 * (places[i].row - front.column_count);
#pragma unroll
      for (int r = 0; r < 3; ++r)
        if (e < count && row + r >= column) panel.at(row + r, column) += numbers[i][r];
    }
  }
  panel.group.synchronize();
}

/// Inverse X of the Cholesky factor of the diagonal block at `first`, by one warp: to `inverse` and into the
/// block itself. Returns false at a pivot that is not positive, in whose place stands 1.
__device__ inline bool invert_diagonal_block(const Panel& panel, int first) {
  constexpr unsigned all = 0xffffffffu;
  const int width = min(panel_width, panel.columns - first), i = lane();
  // Lane i has row i of the block and of its inverse, which is found along with the factor.
  float row[panel_width], x[panel_width];
  bool positive = true;
#pragma unroll
  for (int k = 0; k < panel_width; ++k) {
    row[k] = panel.at(first + min(i, width - 1), first + min(k, width - 1));
    if (i >= width || k >= width) row[k] = i == k ? 1.0f : 0.0f;
    x[k] = i == k ? 1.0f : 0.0f;
  }
#pragma unroll
  for (int k = 0; k < panel_width; ++k) {
    float pivot = __shfl_sync(all, row[k], k);
    if (!(pivot > 0)) {
      positive = false;
      pivot = 1;
    }
    const float scale = rsqrtf(pivot);
    row[k] *= scale;
#pragma unroll
    for (int j = k + 1; j < panel_width; ++j) row[j] -= row[k] * __shfl_sync(all, row[k], j);
    const float below = i > k ? row[k] : 0.0f;
#pragma unroll
    for (int j = 0; j <= k; ++j) {
      if (i == k) x[j] *= scale;
      x[j] -= below * __shfl_sync(all, x[j], k);
    }
  }
  __syncwarp();
  if (i < panel_width) {
#pragma unroll
    for (int k = 0; k < panel_width; ++k) {
      panel.inverse[i * panel_width + k] = x[k];
      if (k <= i && i < width) panel.at(first + i, first + k) = x[k];
    }
  }
  return positive;
}

/// C(row.., column..) of four by four: sum over `depth` columns from `first` of L(row, k) L(column, k).
__device__ inline void outer_product(const Panel& panel, int row, int column, int first, int depth,
                                     float (&sum)[4][4]) {
#pragma unroll 4
  for (int k = first; k < first + depth; ++k) {
    const float4 a = panel.four(row, k), b = panel.four(column, k);
    const float left[4] = {a.x, a.y, a.z, a.w}, right[4] = {b.x, b.y, b.z, b.w};
#pragma unroll
    for (int j = 0; j < 4; ++j)
#pragma unroll
      for (int i = 0; i < 4; ++i) sum[j][i] += left[i] * right[j];
  }
}

/// The four by four tiles of a warp, eight down and four across: what its lanes read together lies together.
struct WarpTile {
  static constexpr int rows = 32, columns = 16;
  int row, column;  ///< of the lane's own tile

  __device__ static WarpTile at(int row, int column) {
    return {row + 4 * (lane() % 8), column + 4 * (lane() / 8)};
  }
};

/// Three times four numbers of a row of the inverse on chip.
__device__ inline void load_inverse_row(const float* row, float (&numbers)[panel_width]) {
#pragma unroll
  for (int k = 0; k < panel_width; k += 4) {
    const float4 four = *reinterpret_cast<const float4*>(row + k);
    numbers[k] = four.x;
    numbers[k + 1] = four.y;
    numbers[k + 2] = four.z;
    numbers[k + 3] = four.w;
  }
}

/// One row of [A11; A21] behind a diagonal block at `first`, times the block's inverse transposed.
__device__ inline void eliminate_row(const Panel& panel, int row, int first, int width) {
  float numbers[panel_width];
#pragma unroll
  for (int k = 0; k < panel_width; ++k) {
    numbers[k] = panel.at(row, min(first + k, panel.columns - 1));
    if (k >= width) numbers[k] = 0;
  }
#pragma unroll
  for (int j = 0; j < panel_width; ++j) {
    float inverse[panel_width], sum = 0;
    load_inverse_row(panel.inverse + j * panel_width, inverse);
#pragma unroll
    for (int k = 0; k <= j; ++k) sum += numbers[k] * inverse[k];
    if (j < width) panel.at(row, first + j) = sum;
  }
}

/// Takes the columns of a panel from `first` on off one tile of the columns behind them.
__device__ inline void update_tile(const Panel& panel, int row, int column, int first) {
  float sum[4][4] = {};
  outer_product(panel, row, column, first, panel_width, sum);
#pragma unroll
  for (int c = 0; c < 4; ++c) {
    if (column + c >= panel.columns) continue;
    float4 target = panel.four(row, column + c);
    target.x -= sum[c][0];
    target.y -= sum[c][1];
    target.z -= sum[c][2];
    target.w -= sum[c][3];
    panel.set_four(row, column + c, target);
  }
}

/// [A11; A21] becomes [L11; L21], diagonal blocks inverted. While a panel is taken off the columns behind it,
/// the first warp goes ahead and inverts the next diagonal block, which nothing else can hide.
__device__ __noinline__ bool eliminate_columns(const FrontLayout& front, const Panel& shared) {
  const Panel panel = shared;
  const int warps = panel.group.size / 32, own_warp = panel.group.rank / 32, leading = front.leading;
  bool positive = true;
  if (own_warp == 0) positive = invert_diagonal_block(panel, 0);
  panel.group.synchronize();
  for (int first = 0;; first += panel_width) {
    const int next = min(first + panel_width, panel.columns);
    for (int row = next + panel.group.rank; row < leading; row += panel.group.size)
      eliminate_row(panel, row, first, next - first);
    panel.group.synchronize();
    if (next == panel.columns) break;
    const int block_end = min(next + panel_width, leading);
    if (own_warp == 0) {
      const int row = next + 4 * (lane() % 4), column = next + 4 * (lane() / 4);
      if (row < block_end && column <= row && column < panel.columns) update_tile(panel, row, column, first);
      __syncwarp();
      positive = invert_diagonal_block(panel, next) && positive;
    }
    const int across = (panel.columns - next + WarpTile::columns - 1) / WarpTile::columns,
              down = (leading - next + WarpTile::rows - 1) / WarpTile::rows;
    const int others = warps > 1 ? warps - 1 : 1;
    for (int tile = warps > 1 ? own_warp - 1 : 0; tile >= 0 && tile < across * down; tile += others) {
      const int j = tile / down, i = tile - j * down;
      const WarpTile own = WarpTile::at(next + WarpTile::rows * i, next + WarpTile::columns * j);
      const bool ahead = own.row < block_end && own.column < block_end;
      if (ahead || own.row < own.column || own.row >= leading || own.column >= panel.columns) continue;
      update_tile(panel, own.row, own.column, first);
    }
    panel.group.synchronize();
  }
  return positive;
}

/// Tile number `index` of a lower triangle of `quads` by `quads` tiles, column after column.
__device__ inline int2 triangle_tile(int index, int quads) {
  // Counted from the end the columns have 1, 2, 3, ... tiles.
  const int left = quads * (quads + 1) / 2 - 1 - index;
  int column = static_cast<int>((sqrtf(8.0f * static_cast<float>(left) + 1.0f) - 1.0f) * 0.5f);
  if ((column + 1) * (column + 2) / 2 <= left) ++column;
  if (column * (column + 1) / 2 > left) --column;
  return {quads - 1 - (left - column * (column + 1) / 2), quads - 1 - column};
}

/// The lower triangle of what the front passes up: its children's update matrices less L21 L21^T. Lanes next
/// to each other have tiles below each other, whose rows lie side by side in all three matrices. Above the
/// diagonal stands anything.
__device__ __noinline__ void make_update(const FrontLayout& front, const Panel& panel, float* update) {
  const int rows = 3 * front.row_count, quads = front.update_leading / 4, below_at = front.below_at,
            leading = front.update_leading;
  const Panel own = panel;
  for (int index = own.group.rank; index < quads * (quads + 1) / 2; index += own.group.size) {
    const int2 tile = triangle_tile(index, quads);
    const int row = 4 * tile.x, column = 4 * tile.y;
    // What children give is on its way while the product is made.
    float given[2][4][4] = {};
#pragma unroll
    for (int k = 0; k < 2; ++k) {
      const Passed& passed = own.passed[k];
      if (passed.update == nullptr) continue;
      const int4 from = *reinterpret_cast<const int4*>(passed.rows + below_at + row);
      const int4 across = *reinterpret_cast<const int4*>(passed.rows + below_at + column);
      const int places[4] = {from.x, from.y, from.z, from.w},
                columns[4] = {across.x, across.y, across.z, across.w};
#pragma unroll
      for (int c = 0; c < 4; ++c)
#pragma unroll
        for (int r = 0; r < 4; ++r)
          if (columns[c] >= 0 && places[r] >= 0)
            given[k][c][r] = passed.update[columns[c] * passed.leading + places[r]];
    }
    float sum[4][4] = {};
    outer_product(own, below_at + row, below_at + column, 0, own.columns, sum);
#pragma unroll
    for (int c = 0; c < 4; ++c)
#pragma unroll
      for (int r = 0; r < 4; ++r) sum[c][r] = given[0][c][r] + given[1][c][r] - sum[c][r];
#pragma unroll
    for (int c = 0; c < 4; ++c)
      if (column + c < rows)
        *reinterpret_cast<float4*>(update + (column + c) * leading + row) =
            float4{sum[c][0], sum[c][1], sum[c][2], sum[c][3]};
  }
}

/// The inverse of the diagonal block at `first`, out of the panel.
__device__ inline void fetch_inverse(const Panel& panel, int first) {
  const int width = min(panel_width, panel.columns - first);
  for (int i = panel.group.rank; i < panel_width * panel_width; i += panel.group.size) {
    const int row = i / panel_width, column = i - row * panel_width;
    panel.inverse[i] = row < width && column <= row ? panel.at(first + row, first + column) : 0.0f;
  }
}

/// One row of the columns at `first` of W, from those behind them: -(L21 + W_behind L_behind) X. `own`: a row
/// of L11^-1.
__device__ inline void inverse_row(const Panel& panel, int row, bool own, int first, int next,
                                   float (&result)[panel_width]) {
  // Columns behind the last stand for it, so that there is no branch; what comes of them meets a zero.
  const int end = own ? row + 1 : panel.columns;
  float sum[panel_width];
#pragma unroll
  for (int j = 0; j < panel_width; ++j) sum[j] = own ? 0.0f : panel.at(row, min(first + j, next - 1));
  for (int k = next; k < end; k += 4) {
    float left[4];
#pragma unroll
    for (int i = 0; i < 4; ++i) {
      left[i] = panel.at(row, min(k + i, panel.columns - 1));
      if (k + i >= end) left[i] = 0;
    }
    // Before the last block all are full.
#pragma unroll
    for (int j = 0; j < panel_width; ++j) {
      const float4 right = panel.four(k, first + j);
      sum[j] += (left[0] * right.x + left[1] * right.y) + (left[2] * right.z + left[3] * right.w);
    }
  }
#pragma unroll
  for (int j = 0; j < panel_width; ++j) result[j] = 0;
#pragma unroll
  for (int k = 0; k < panel_width; ++k) {
    float inverse[panel_width];
    load_inverse_row(panel.inverse + k * panel_width, inverse);
#pragma unroll
    for (int j = 0; j <= k; ++j) result[j] -= sum[k] * inverse[j];
  }
}

/// [L11; L21], diagonal blocks inverted, becomes [L11^-1; -L21 L11^-1], the last panel first.
__device__ __noinline__ void invert_columns(const FrontLayout& front, const Panel& shared) {
  const Panel panel = shared;
  const int below_at = front.below_at, below = front.leading - below_at;
  const int last = (panel.columns - 1) / panel_width * panel_width;
  fetch_inverse(panel, last);
  panel.group.synchronize();
  for (int first = last; first >= 0; first -= panel_width) {
    const int next = min(first + panel_width, panel.columns), width = next - first;
    const int own_rows = panel.columns - next, all_rows = own_rows + below;
    const auto row_of = [&](int i) { return i < own_rows ? next + i : below_at + i - own_rows; };
    const auto put = [&](int row, const float(&numbers)[panel_width]) {
#pragma unroll
      for (int j = 0; j < panel_width; ++j)
        if (j < width) panel.at(row, first + j) = numbers[j];
    };
    // Own rows, which all others read here, come first: one a thread at most, kept until all are read.
    const int mine = panel.group.rank;
    float numbers[panel_width];
    for (int i = mine + panel.group.size; i < all_rows; i += panel.group.size) {
      inverse_row(panel, row_of(i), false, first, next, numbers);
      put(row_of(i), numbers);
    }
    if (mine < all_rows) inverse_row(panel, row_of(mine), mine < own_rows, first, next, numbers);
    panel.group.synchronize();
    if (mine < all_rows) put(row_of(mine), numbers);
    if (first > 0) fetch_inverse(panel, first - panel_width);
    panel.group.synchronize();
  }
}

template <typename Stored>
__device__ void store_columns(const FrontLayout& front, const Panel& panel, Stored* factor) {
  for (int column = panel.group.rank / 32; column < panel.columns; column += panel.group.size / 32) {
    Stored* to = factor + static_cast<long>(column) * front.leading;
    for (int row = 4 * lane(); row < front.leading; row += 128) {
      float4 four = panel.four(row, column);
      if (row < column) four.x = 0;
      if (row + 1 < column) four.y = 0;
      if (row + 2 < column) four.z = 0;
      if (row + 3 < column) four.w = 0;
      store_four(four, to + row);
    }
  }
}

/// The factor of the matrix `blocks`, nine numbers a block of the pattern, column-major. `updates`: memory
/// for FrontTables::update_size numbers; `chip`: factor_memory on chip. Returns, to some threads at least,
/// whether all pivots were positive.
template <typename Stored>
__device__ bool factorize(const FrontTables& tables, const float* blocks, float* updates, Stored* factor,
                          float* chip) {
  bool positive = true;
  int* rows_in_children = reinterpret_cast<int*>(chip + tables.shared_panel);
  float* inverses = chip + tables.shared_panel + 2 * tables.shared_rows;
  for (int l = 0; l < tables.level_count; ++l) {
    __syncthreads();
    const FrontLevel level = tables.levels[l];
    const Group group = Group::of(level.groups);
    int* rows = rows_in_children + 2 * (tables.shared_rows / level.groups / 4 * 4) * group.index;
    for (int f = level.first_front + group.index; f < level.first_front + level.front_count;
         f += level.groups) {
      const FrontLayout front = tables.fronts[f];
      Panel panel;
      panel.numbers = chip + tables.shared_panel / level.groups / 4 * 4 * group.index;
      panel.inverse = inverses + group.index * panel_width * panel_width;
      panel.leading = front.leading + panel_padding;
      panel.columns = 3 * front.column_count;
      panel.group = group;
#pragma unroll
      for (int k = 0; k < 2; ++k) {
        panel.passed[k] = {nullptr, 0, rows + k * front.leading};
        if (front.children[k] < 0) continue;
        const FrontLayout& child = tables.fronts[front.children[k]];
        panel.passed[k].update = updates + child.update_at;
        panel.passed[k].leading = child.update_leading;
      }
      if (front.children[0] >= 0 || front.children[1] >= 0) {
        find_rows(tables, front, panel, rows);
        group.synchronize();
      }
      assemble_columns(tables, front, blocks, panel);
      positive = eliminate_columns(front, panel) && positive;
      make_update(front, panel, updates + front.update_at);
      group.synchronize();
      invert_columns(front, panel);
      store_columns(front, panel, factor + front.panel_at);
      group.synchronize();
    }
  }
  __syncthreads();
  return positive;
}

}  // namespace flash::sim::cuda
