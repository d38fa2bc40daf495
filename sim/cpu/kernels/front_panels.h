#pragma once
#include "sim/cpu/kernels/dense_front.h"
#include "sim/cpu/kernels/four.h"
#include "sim/cpu/kernels/stored.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

// A factorized front for solves: panels of `Width` columns (12: four vertices, or 3: one), each eliminated as
// a whole,
//   [A_pp A_rp^T; A_rp A_rr] = [I 0; W I] [D 0; 0 A_rr - W D W^T] [I W^T; 0 I],
// with D = L_pp L_pp^T and W = L_rp L_pp^-1. Within a panel no number waits for another, as it would in a
// substitution.

/// Width of the next panel when `left` columns remain.
constexpr int panel_width(int left) { return left >= 12 ? 12 : 3; }

/// Row stride of a panel's inverse, in numbers.
constexpr int inverse_stride(int width) { return width / 3 * 4; }

/// Turns the panel at row `first` of a front's [L11; L21] into W, with zeros in its own rows; D^-1 goes to
/// `inverse`. Overwrites its columns.
template <int Width, typename Scalar>
void eliminate_panel(Scalar* columns, int padded_rows, int first, Scalar* inverse, Stored<Scalar>* panel) {
  using Vector = typename VectorOf<Scalar>::type;
  using Four = typename FourOf<Scalar>::type;
  constexpr int stride = inverse_stride(Width);
  Scalar lower[Width][Width], scales[Width], rows[Width][stride] = {};  // L_pp, and L_pp^-1 row by row
  const int first_vector = (first + Width) / lanes_of<Scalar> * lanes_of<Scalar>;
  for (int j = 0; j < Width; ++j) {
    Scalar* column = columns + static_cast<long>(j) * padded_rows;
    for (int i = j; i < Width; ++i) lower[i][j] = column[first + i];
    for (int i = first_vector; i < first + Width; ++i) column[i] = 0;
  }
  for (int i = 0; i < Width; ++i) {
    scales[i] = 1 / lower[i][i];
    rows[i][i] = 1;
    for (int j = 0; j < stride; j += 4) {
      Four sum = load_four(rows[i] + j);
      for (int k = 0; k < i; ++k) sum -= lower[i][k] * load_four(rows[k] + j);
      store_four<Scalar>(scales[i] * sum, rows[i] + j);
    }
  }
  for (int i = 0; i < Width; ++i) {
    for (int j = 0; j < stride; j += 4) {
      Four sum = {};
      for (int k = i; k < Width; ++k) sum += rows[k][i] * load_four(rows[k] + j);
      store_four<Scalar>(sum, inverse + i * stride + j);
    }
  }
  for (int row = first_vector; row < padded_rows; row += lanes_of<Scalar>) {
    Vector w[Width];
    for (int j = 0; j < Width; ++j)
      w[j] = *reinterpret_cast<const Vector*>(columns + static_cast<long>(j) * padded_rows + row);
#pragma GCC unroll 12
    for (int j = Width - 1; j >= 0; --j) {
      w[j] *= scales[j];
#pragma GCC unroll 12
      for (int k = 0; k < j; ++k) w[k] -= lower[j][k] * w[j];
    }
    for (int j = 0; j < Width; ++j) store_rounded(w[j], panel + static_cast<long>(j) * padded_rows + row);
  }
}

// One right-hand side through a front, in place: x holds the front's own entries, then those below, then
// zeros up to `padded_rows`.

/// x_r <- x_r - W x_p.
template <int Width, typename Scalar>
void solve_panel_forward(const Stored<Scalar>* panel, int padded_rows, int first, Scalar* x) {
  using Vector = typename VectorOf<Scalar>::type;
  Scalar own[Width];
  for (int j = 0; j < Width; ++j) own[j] = x[first + j];
  for (int i = (first + Width) / lanes_of<Scalar> * lanes_of<Scalar>; i < padded_rows;
       i += lanes_of<Scalar>) {
    Vector sums[3] = {};
#pragma GCC unroll 12
    for (int j = 0; j < Width; ++j)
      sums[j % 3] += load_stored<Scalar>(panel + static_cast<long>(j) * padded_rows + i) * own[j];
    *reinterpret_cast<Vector*>(x + i) -= sums[0] + (sums[1] + sums[2]);
  }
}

/// Sum of the vector's quarters.
template <typename Scalar>
[[gnu::always_inline]] inline typename FourOf<Scalar>::type fold(
    const typename VectorOf<Scalar>::type& vector) {
  constexpr int parts = lanes_of<Scalar> / 4;
  typename FourOf<Scalar>::type fours[parts];
  memcpy(fours, &vector, sizeof(vector));
  for (int half = parts / 2; half > 0; half /= 2)
    for (int k = 0; k < half; ++k) fours[k] += fours[k + half];
  return fours[0];
}

/// Sums over the lanes of four vectors.
template <typename Scalar>
[[gnu::always_inline]] inline typename FourOf<Scalar>::type sums_of_lanes(
    const typename VectorOf<Scalar>::type* vectors) {
  using Four = typename FourOf<Scalar>::type;
  if constexpr (lanes_of<Scalar> < 4) {
    Four sums;
    for (int k = 0; k < 4; ++k) sums[k] = vectors[k][0] + vectors[k][1];
    return sums;
  } else {
    const Four a = fold<Scalar>(vectors[0]), b = fold<Scalar>(vectors[1]), c = fold<Scalar>(vectors[2]),
               d = fold<Scalar>(vectors[3]);
    const Four ab = __builtin_shufflevector(a, b, 0, 4, 1, 5) + __builtin_shufflevector(a, b, 2, 6, 3, 7),
               cd = __builtin_shufflevector(c, d, 0, 4, 1, 5) + __builtin_shufflevector(c, d, 2, 6, 3, 7);
    return __builtin_shufflevector(ab, cd, 0, 1, 4, 5) + __builtin_shufflevector(ab, cd, 2, 3, 6, 7);
  }
}

/// x_p <- D^-1 x_p - W^T x_r.
template <int Width, typename Scalar>
void solve_panel_backward(const Stored<Scalar>* panel, int padded_rows, int first, const Scalar* inverse,
                          Scalar* x) {
  using Vector = typename VectorOf<Scalar>::type;
  using Four = typename FourOf<Scalar>::type;
  constexpr int stride = inverse_stride(Width);
  Vector sums[stride] = {};
  for (int i = (first + Width) / lanes_of<Scalar> * lanes_of<Scalar>; i < padded_rows;
       i += lanes_of<Scalar>) {
    const Vector below = *reinterpret_cast<const Vector*>(x + i);
#pragma GCC unroll 12
    for (int j = 0; j < Width; ++j)
      sums[j] += load_stored<Scalar>(panel + static_cast<long>(j) * padded_rows + i) * below;
  }
  Four own[stride / 4] = {};
  for (int j = 0; j < Width; ++j)
    for (int k = 0; k < stride / 4; ++k) own[k] += load_four(inverse + j * stride + 4 * k) * x[first + j];
  Scalar result[stride];
  for (int k = 0; k < stride / 4; ++k)
    store_four<Scalar>(own[k] - sums_of_lanes<Scalar>(sums + 4 * k), result + 4 * k);
  memcpy(x + first, result, Width * sizeof(Scalar));
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
