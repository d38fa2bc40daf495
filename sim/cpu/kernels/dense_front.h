#pragma once
#include "sim/law/lanes.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

// Dense kernels of the multifrontal factorization. Column-major, leading dimensions a multiple of
// `front_padding`, so that a column is whole vectors; what the padding rows hold is never read as an entry.

template <typename Scalar>
struct VectorOf {
  typedef Scalar type __attribute__((vector_size(vector_bytes), aligned(sizeof(Scalar))));
};

/// Calls work.template operator()<Width>() with the one of two widths that `width` is.
template <int Wide, int Narrow, typename Work>
[[gnu::always_inline]] inline auto with_width(int width, const Work& work) {
  if (width == Wide) return work.template operator()<Wide>();
  return work.template operator()<Narrow>();
}

/// C(i, j) -= sum_k A(i, k) B(j, k) for `Width` columns j and whole vectors of rows [first_row, end_row): 2 x
/// Width register tiles, 2 loads and Width broadcasts for 2 Width multiply-adds.
template <int Width, typename Scalar>
void subtract_product(Scalar* c, int ldc, const Scalar* a, const Scalar* b, int lda, int depth, int first_row,
                      int end_row) {
  using Vector = typename VectorOf<Scalar>::type;
  constexpr int step = lanes_of<Scalar>;
  int row = first_row;
  for (; row + 2 * step <= end_row; row += 2 * step) {
    Vector low[Width], high[Width];
    for (int j = 0; j < Width; ++j) low[j] = high[j] = Vector{};
    for (int k = 0; k < depth; ++k) {
      const Scalar* column = a + static_cast<long>(k) * lda + row;
      const Vector a_low = *reinterpret_cast<const Vector*>(column);
      const Vector a_high = *reinterpret_cast<const Vector*>(column + step);
      const Scalar* factors = b + static_cast<long>(k) * lda;
#pragma GCC unroll 6
      for (int j = 0; j < Width; ++j) {
        low[j] += a_low * factors[j];
        high[j] += a_high * factors[j];
      }
    }
    for (int j = 0; j < Width; ++j) {
      Scalar* target = c + static_cast<long>(j) * ldc + row;
      *reinterpret_cast<Vector*>(target) -= low[j];
      *reinterpret_cast<Vector*>(target + step) -= high[j];
    }
  }
  for (; row < end_row; row += step) {
    Vector sum[Width];
    for (int j = 0; j < Width; ++j) sum[j] = Vector{};
    for (int k = 0; k < depth; ++k) {
      const Vector a_row = *reinterpret_cast<const Vector*>(a + static_cast<long>(k) * lda + row);
      const Scalar* factors = b + static_cast<long>(k) * lda;
#pragma GCC unroll 6
      for (int j = 0; j < Width; ++j) sum[j] += a_row * factors[j];
    }
    for (int j = 0; j < Width; ++j)
      *reinterpret_cast<Vector*>(c + static_cast<long>(j) * ldc + row) -= sum[j];
  }
}

/// Cholesky of `Width` columns from row `first` on, to which nothing is left to subtract. Returns false at a
/// pivot that is not positive.
template <int Width, typename Scalar>
bool eliminate_few_columns(Scalar* columns, int padded_rows, int first) {
  using Vector = typename VectorOf<Scalar>::type;
  Scalar lower[Width][Width], scales[Width];
  for (int j = 0; j < Width; ++j)
    for (int i = j; i < Width; ++i) lower[i][j] = columns[static_cast<long>(j) * padded_rows + first + i];
  for (int j = 0; j < Width; ++j) {
    if (!(lower[j][j] > 0)) return false;
    scales[j] = 1 / square_root(lower[j][j]);
    for (int i = j + 1; i < Width; ++i) lower[i][j] *= scales[j];
    for (int k = j + 1; k < Width; ++k)
      for (int i = k; i < Width; ++i) lower[i][k] -= lower[k][j] * lower[i][j];
  }
  for (int row = first / lanes_of<Scalar> * lanes_of<Scalar>; row < padded_rows; row += lanes_of<Scalar>) {
    Vector rows[Width];
    for (int j = 0; j < Width; ++j)
      rows[j] = *reinterpret_cast<const Vector*>(columns + static_cast<long>(j) * padded_rows + row);
#pragma GCC unroll 6
    for (int j = 0; j < Width; ++j) {
      rows[j] *= scales[j];
#pragma GCC unroll 6
      for (int k = j + 1; k < Width; ++k) rows[k] -= lower[k][j] * rows[j];
    }
    for (int j = 0; j < Width; ++j)
      *reinterpret_cast<Vector*>(columns + static_cast<long>(j) * padded_rows + row) = rows[j];
  }
  return true;
}

/// Cholesky of the leading `columns` (a multiple of 3) of a front of `padded_rows` rows: on return the lower
/// trapezoid holds [L11; L21]. Returns false at a pivot that is not positive.
template <typename Scalar>
bool eliminate_columns(Scalar* front, int padded_rows, int columns) {
  for (int panel = 0; panel < columns;) {
    const int width = columns - panel >= 6 ? 6 : 3;
    const int first = panel / lanes_of<Scalar> * lanes_of<Scalar>;
    Scalar* target = front + static_cast<long>(panel) * padded_rows;
    const bool positive = with_width<6, 3>(width, [&]<int Width>() {
      subtract_product<Width>(target, padded_rows, front, front + panel, padded_rows, panel, first,
                              padded_rows);
      return eliminate_few_columns<Width>(target, padded_rows, panel);
    });
    if (!positive) return false;
    panel += width;
  }
  return true;
}

/// update -= L21 L21^T on the lower triangle; L21 starts `columns` rows down the front. `rows` a multiple
/// of 3. Reads up to a vector past the front's last column.
template <typename Scalar>
void subtract_outer_product(Scalar* update, int padded_update_rows, int rows, const Scalar* front,
                            int padded_rows, int columns) {
  const Scalar* below = front + columns;
  for (int j = 0; j < rows;) {
    const int width = rows - j >= 6 ? 6 : 3;
    const int first = j / lanes_of<Scalar> * lanes_of<Scalar>;
    Scalar* target = update + static_cast<long>(j) * padded_update_rows;
    with_width<6, 3>(width, [&]<int Width>() {
      subtract_product<Width>(target, padded_update_rows, below, below + j, padded_rows, columns, first,
                              padded_update_rows);
    });
    j += width;
  }
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
