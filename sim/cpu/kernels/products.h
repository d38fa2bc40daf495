#pragma once
#ifdef __AVX512F__
#include <immintrin.h>
#endif

#include "sim/cpu/kernels.h"
#include "sim/cpu/kernels/four.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

template <typename Scalar>
void copy_blocks(int count, const int* sources, const char* transposed, const double* from, Scalar* to) {
  for (int k = 0; k < count; ++k, to += 12) {
    const double* block = from + 9L * sources[k];
    if (transposed[k]) {
      for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r) to[4 * c + r] = static_cast<Scalar>(block[3 * r + c]);
    } else {
      for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r) to[4 * c + r] = static_cast<Scalar>(block[3 * c + r]);
    }
  }
}

template <typename Scalar>
void multiply_blocks(const BlockRows& rows, const Scalar* blocks, const Scalar* x, Scalar* y) {
  using Four = typename FourOf<Scalar>::type;
  for (int i = 0; i < rows.size; ++i) {
    Four column_0{}, column_1{}, column_2{};
    for (int k = rows.starts[i]; k < rows.starts[i + 1]; ++k) {
      const Scalar *block = blocks + 12L * k, *from = x + 4L * rows.columns[k];
      column_0 += load_four(block) * from[0];
      column_1 += load_four(block + 4) * from[1];
      column_2 += load_four(block + 8) * from[2];
    }
    store_four<Scalar>(column_0 + (column_1 + column_2), y + 4L * i);
  }
}

/// What a group's columns `first` to `end` contribute: four numbers for each of four rows.
template <typename Scalar>
void sum_columns(const int* columns, const Scalar* values, int first, int end, const Scalar* x,
                 Scalar* sums) {
  using Four = typename FourOf<Scalar>::type;
  Four even[4] = {}, odd[4] = {};
  const auto add = [&](int k, Four* rows) {
    const Four vertex = load_four(x + 4L * columns[k]);
    for (int row = 0; row < 4; ++row) rows[row] += values[4L * k + row] * vertex;
  };
  int k = first;
  for (; k + 1 < end; k += 2) {
    add(k, even);
    add(k + 1, odd);
  }
  if (k < end) add(k, even);
  for (int row = 0; row < 4; ++row) store_four<Scalar>(even[row] + odd[row], sums + 4 * row);
}

#ifdef __AVX512F__
/// One vector holds all four rows: two loads and a permutation serve sixteen multiply-adds.
template <>
inline void sum_columns(const int* columns, const float* values, int first, int end, const float* x,
                        float* sums) {
  const __m512i row_of_lane = _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
  __m512 partial[4] = {_mm512_setzero_ps(), _mm512_setzero_ps(), _mm512_setzero_ps(), _mm512_setzero_ps()};
  const auto add = [&](int k, __m512& sum) {
    const __m512 entries = _mm512_castps128_ps512(_mm_loadu_ps(values + 4L * k));
    sum = _mm512_fmadd_ps(_mm512_permutexvar_ps(row_of_lane, entries),
                          _mm512_broadcast_f32x4(_mm_loadu_ps(x + 4L * columns[k])), sum);
  };
  int k = first;
  for (; k + 3 < end; k += 4)
    for (int part = 0; part < 4; ++part) add(k + part, partial[part]);
  for (; k < end; ++k) add(k, partial[0]);
  _mm512_storeu_ps(sums, (partial[0] + partial[1]) + (partial[2] + partial[3]));
}
#endif

template <typename Scalar>
void add_rows(const FourRows& groups, const Scalar* values, Scalar scale, const Scalar* x, Scalar* y) {
  for (int g = 0; g < groups.size; ++g) {
    Scalar sums[16];
    sum_columns(groups.columns, values, groups.starts[g], groups.starts[g + 1], x, sums);
    for (int member = 0; member < 4; ++member) {
      const int row = groups.rows[4L * g + member];
      if (row < 0) break;
      store_four<Scalar>(load_four(y + 4L * row) + scale * load_four(sums + 4 * member), y + 4L * row);
    }
  }
}

/// The dot product by sixteen partial sums, in the same order at every level.
template <typename Scalar>
Scalar dot(long size, const Scalar* x, const Scalar* y) {
  constexpr int width = 16;
  Scalar sums[width] = {};
  long i = 0;
  for (; i + width <= size; i += width)
    for (int k = 0; k < width; ++k) sums[k] += x[i + k] * y[i + k];
  for (int k = 0; i < size; ++i, ++k) sums[k] += x[i] * y[i];
  for (int half = width / 2; half > 0; half /= 2)
    for (int k = 0; k < half; ++k) sums[k] += sums[k + half];
  return sums[0];
}

template <typename Scalar>
void add_scaled(long size, Scalar a, const Scalar* x, Scalar* y) {
  for (long i = 0; i < size; ++i) y[i] += a * x[i];
}

template <typename Scalar>
void scale_and_add(long size, Scalar b, const Scalar* x, Scalar* y) {
  for (long i = 0; i < size; ++i) y[i] = x[i] + b * y[i];
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
