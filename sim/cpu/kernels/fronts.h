#pragma once
#include "sim/cpu/kernels.h"
#include "sim/cpu/kernels/front_panels.h"

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
      // An update matrix starts at the row below the parent's own.
      const bool eliminated = target_column < own;
      const long first_row = eliminated ? 0 : own;
      Scalar* target = eliminated
                           ? columns + static_cast<long>(target_column + c) * parent.padded_rows
                           : update + static_cast<long>(target_column - own + c) * parent.padded_update_rows;
      for (int row = column; row < child.row_count; ++row) {
        Scalar* entry = target + (3L * map[row] - first_row);
        entry[0] += source[3 * row];
        entry[1] += source[3 * row + 1];
        entry[2] += source[3 * row + 2];
      }
    }
  }
}

template <typename Scalar>
bool factorize(const FrontTree& tree, const double* values, Scalar* columns, Scalar* stack, void* factor,
               Scalar* inverses) {
  for (int f = 0; f < tree.front_count; ++f) {
    const Front& front = tree.fronts[f];
    const int count = 3 * front.column_count, rows = 3 * front.row_count;
    Scalar* update = stack + front.built_at;
    const long update_size = static_cast<long>(front.padded_update_rows) * rows;
    memset(columns, 0, sizeof(Scalar) * front.padded_rows * count);
    if (rows > 0) memset(update, 0, sizeof(Scalar) * update_size);
    place_blocks(tree, front, values, columns);
    for (int k = front.first_child; k < front.first_child + front.child_count; ++k) {
      const Front& child = tree.fronts[tree.children[k]];
      extend_add(tree, child, front, stack + child.update_at, columns, update);
    }
    if (!eliminate_columns(columns, front.padded_rows, count)) return false;
    if (rows > 0)
      subtract_outer_product(update, front.padded_update_rows, rows, columns, front.padded_rows, count);
    if (rows > 0 && front.update_at != front.built_at)
      memmove(stack + front.update_at, update, sizeof(Scalar) * update_size);
    for (int first = 0; first < count; first += panel_width(count - first)) {
      const long offset = static_cast<long>(first) * front.padded_rows;
      Scalar* inverse = inverses + inverse_size * (front.first_column + first / 3);
      Stored<Scalar>* panel = static_cast<Stored<Scalar>*>(factor) + front.columns_at + offset;
      with_width<12, 3>(panel_width(count - first), [&]<int Width>() {
        eliminate_panel<Width>(columns + offset, front.padded_rows, first, inverse, panel);
      });
    }
  }
  return true;
}

/// Copies a vertex by one move of four numbers, of which it owns three.
template <typename Scalar>
void copy_vertex(const Scalar* from, Scalar* to) {
  memcpy(to, from, 4 * sizeof(Scalar));
}

/// The numbers of a front's own vertices and of those below, three a vertex, then zeros for its padding.
template <typename Scalar>
void gather(const FrontTree& tree, const Front& front, const Scalar* x, Scalar* numbers) {
  const Scalar* own = x + 4L * front.first_column;
  for (int c = 0; c < front.column_count; ++c, numbers += 3) copy_vertex(own + 4L * c, numbers);
  const int* rows = tree.rows + front.first_row;
  for (int r = 0; r < front.row_count; ++r, numbers += 3) copy_vertex(x + 4L * rows[r], numbers);
  memset(numbers, 0, front_padding * sizeof(Scalar));
}

template <typename Scalar>
void solve(const FrontTree& tree, const void* factor, const Scalar* inverses, Scalar* numbers, Scalar* x) {
  for (int f = 0; f < tree.front_count; ++f) {
    const Front& front = tree.fronts[f];
    const int columns = 3 * front.column_count;
    gather(tree, front, x, numbers);
    const Stored<Scalar>* panel = static_cast<const Stored<Scalar>*>(factor) + front.columns_at;
    for (int first = 0; first < columns;) {
      const int width = panel_width(columns - first);
      with_width<12, 3>(width, [&]<int Width>() {
        solve_panel_forward<Width, Scalar>(panel, front.padded_rows, first, numbers);
      });
      panel += static_cast<long>(width) * front.padded_rows;
      first += width;
    }
    for (int c = 1; c < front.column_count; ++c)
      copy_vertex(numbers + 3L * c, x + 4L * (front.first_column + c));
    const int* rows = tree.rows + front.first_row;
    for (int r = 0; r < front.row_count; ++r) copy_vertex(numbers + columns + 3L * r, x + 4L * rows[r]);
  }
  for (int f = tree.front_count; f-- > 0;) {
    const Front& front = tree.fronts[f];
    const int columns = 3 * front.column_count;
    gather(tree, front, x, numbers);
    // The narrow panels come last, so this loop meets them first.
    for (int first = columns; first > 0;) {
      const int width = first % 12 == 0 ? 12 : 3;
      first -= width;
      const Stored<Scalar>* panel = static_cast<const Stored<Scalar>*>(factor) + front.columns_at +
                                    static_cast<long>(first) * front.padded_rows;
      const Scalar* inverse = inverses + inverse_size * (front.first_column + first / 3);
      with_width<12, 3>(width, [&]<int Width>() {
        solve_panel_backward<Width, Scalar>(panel, front.padded_rows, first, inverse, numbers);
      });
    }
    for (int c = 0; c < front.column_count; ++c) {
      Scalar* own = x + 4L * (front.first_column + c);
      copy_vertex(numbers + 3L * c, own);
      own[3] = 0;
    }
  }
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
