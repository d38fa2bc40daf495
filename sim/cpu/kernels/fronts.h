#pragma once
#include "sim/cpu/kernels.h"
#include "sim/cpu/kernels/dense_front.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

// The multifrontal factorization over the elimination tree, and solves with it (Duff and Reid 1983; Liu
// 1992).

/// Puts the matrix's blocks into the columns of a front.
template <typename Scalar>
void place_blocks(const FrontTree& tree, const Front& front, const double* values, Scalar* columns) {
  for (int k = front.first_block; k < front.first_block + front.block_count; ++k) {
    const FrontBlock& place = tree.blocks[k];
    const double* block = values + 9L * place.source;
    Scalar* target = columns + 3L * place.column * front.padded_rows + 3L * place.row;
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r)
        target[c * front.padded_rows + r] =
            static_cast<Scalar>(place.transposed ? block[3 * r + c] : block[3 * c + r]);
  }
}

/// Adds a child's update matrix to the columns of its parent and to the parent's own update matrix.
template <typename Scalar>
void extend_add(const FrontTree& tree, const Front& child, const Front& parent, const Scalar* source,
                Scalar* columns, Scalar* update) {
  const int* map = tree.rows_in_parent + child.first_row;
  const int own = 3 * parent.column_count;
  for (int column = 0; column < child.row_count; ++column) {
    const int target_column = 3 * map[column];
    for (int c = 0; c < 3; ++c, source += child.padded_update_rows) {
      Scalar* target =
          target_column < own
              ? columns + static_cast<long>(target_column + c) * parent.padded_rows
              : update + static_cast<long>(target_column - own + c) * parent.padded_update_rows - own;
      for (int row = column; row < child.row_count; ++row) {
        Scalar* entry = target + 3 * map[row];
        entry[0] += source[3 * row];
        entry[1] += source[3 * row + 1];
        entry[2] += source[3 * row + 2];
      }
    }
  }
}

template <typename Scalar>
bool factorize(const FrontTree& tree, const double* values, Scalar* factor, Scalar* stack, Scalar* inverses) {
  for (int f = 0; f < tree.front_count; ++f) {
    const Front& front = tree.fronts[f];
    const int columns = 3 * front.column_count, rows = 3 * front.row_count;
    Scalar *own = factor + front.columns_at, *update = stack + front.built_at;
    const long update_size = static_cast<long>(front.padded_update_rows) * rows;
    memset(own, 0, sizeof(Scalar) * front.padded_rows * columns);
    if (rows > 0) memset(update, 0, sizeof(Scalar) * update_size);
    place_blocks(tree, front, values, own);
    for (int k = front.first_child; k < front.first_child + front.child_count; ++k) {
      const Front& child = tree.fronts[tree.children[k]];
      extend_add(tree, child, front, stack + child.update_at, own, update);
    }
    if (!eliminate_columns(own, front.padded_rows, columns)) return false;
    if (rows > 0)
      subtract_outer_product(update, front.padded_update_rows, rows, own, front.padded_rows, columns);
    extract_diagonal(own, front.padded_rows, columns, inverses + 6L * front.first_column);
    if (rows > 0 && front.update_at != front.built_at)
      memmove(stack + front.update_at, update, sizeof(Scalar) * update_size);
  }
  return true;
}

// Few numbers: a call of memmove would cost more than the copy.
template <typename Scalar>
void copy_vertex(const Scalar* from, Scalar* to) {
  to[0] = from[0];
  to[1] = from[1];
  to[2] = from[2];
}

template <typename Scalar>
void copy_vertices(const Scalar* from, int count, Scalar* to) {
  for (int i = 0; i < count; ++i) copy_vertex(from + 3L * i, to + 3L * i);
}

/// The numbers of a front's own vertices, of those below, then zeros up to its padding.
template <typename Scalar>
void gather(const FrontTree& tree, const Front& front, const Scalar* x, Scalar* numbers) {
  const int columns = 3 * front.column_count;
  copy_vertices(x + 3L * front.first_column, front.column_count, numbers);
  const int* rows = tree.rows + front.first_row;
  for (int r = 0; r < front.row_count; ++r) copy_vertex(x + 3L * rows[r], numbers + columns + 3L * r);
  for (int i = columns + 3 * front.row_count; i < front.padded_rows; ++i) numbers[i] = 0;
}

template <typename Scalar>
void solve(const FrontTree& tree, const Scalar* factor, const Scalar* inverses, Scalar* numbers, Scalar* x) {
  for (int f = 0; f < tree.front_count; ++f) {
    const Front& front = tree.fronts[f];
    const int columns = 3 * front.column_count;
    const int* rows = tree.rows + front.first_row;
    gather(tree, front, x, numbers);
    solve_forward(factor + front.columns_at, front.padded_rows, columns, inverses + 6L * front.first_column,
                  numbers);
    copy_vertices(numbers, front.column_count, x + 3L * front.first_column);
    for (int r = 0; r < front.row_count; ++r) copy_vertex(numbers + columns + 3L * r, x + 3L * rows[r]);
  }
  for (int f = tree.front_count; f-- > 0;) {
    const Front& front = tree.fronts[f];
    gather(tree, front, x, numbers);
    solve_backward(factor + front.columns_at, front.padded_rows, 3 * front.column_count,
                   inverses + 6L * front.first_column, numbers);
    copy_vertices(numbers, front.column_count, x + 3L * front.first_column);
  }
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
