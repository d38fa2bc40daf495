#pragma once
#include <cuda_fp16.h>

#include "sim/cuda/layout/front_layout.h"
#include "sim/cuda/team.cuh"

namespace flash::sim::cuda {

// A tile of the factor as tensor cores take it: four squares of eight rows and columns, the two of the left
// half first, each row after row. In half precision a number is one part, in single precision the sum of two.

/// Numbers of half precision that a number of the factor is stored as.
inline constexpr int half_parts = 1, single_parts = 2;

template <int parts>
inline constexpr int solve_tile_bytes = parts* solve_tile_numbers* static_cast<int>(sizeof(__half));

/// Two numbers of half precision in a word, the first in its low bits.
__device__ inline unsigned word_of(__half first, __half second) {
  return __half_as_ushort(first) | static_cast<unsigned>(__half_as_ushort(second)) << 16;
}

/// A number as the sum of two of half precision.
struct HalfPair {
  __half high, low;

  __device__ explicit HalfPair(float number)
      : high(__float2half_rn(number)), low(__float2half_rn(number - __half2float(high))) {}
};

/// Where the number at `row` and `column` of a tile is, in the first part of it.
__device__ inline int place_in_tile(int row, int column) {
  return (column / 8 * 2 + row / 8) * 64 + row % 8 * 8 + column % 8;
}

/// A front's columns in the factor.
template <int parts>
struct FactorColumns {
  __half* first;
  int column_tiles;

  /// Where the number at `row` of the first column is, in the first part of its tile.
  __device__ __half* row(int row) const {
    const long tile = static_cast<long>(row / solve_tile_width) * column_tiles;
    return first + tile * parts * solve_tile_numbers + place_in_tile(row % solve_tile_width, 0);
  }
  /// From there to another column.
  __device__ static int column(int column) {
    return column / solve_tile_width * parts * solve_tile_numbers +
           place_in_tile(0, column % solve_tile_width);
  }
};
/// From a row to the next one of the same eight.
inline constexpr int solve_tile_row = 8;

/// Writes two numbers next to each other in a row, the first in an even column. `to`: of the first part.
template <int parts>
__device__ void store_two(float first, float second, __half* to) {
  const HalfPair a(first), b(second);
  *reinterpret_cast<unsigned*>(to) = word_of(a.high, b.high);
  if constexpr (parts == single_parts)
    *reinterpret_cast<unsigned*>(to + solve_tile_numbers) = word_of(a.low, b.low);
}

/// A left factor of 16 rows and columns, as a warp holds it.
struct LeftTileHalf {
  unsigned words[4];
};

/// The tile at `tile` on chip, or its transpose.
template <bool transposed>
__device__ LeftTileHalf load_solve_tile(unsigned tile) {
  LeftTileHalf left;
  unsigned* w = left.words;
  if constexpr (transposed)
    // The second square is that to the right, the third that below.
    asm volatile("ldmatrix.sync.aligned.m8n8.x4.trans.shared.b16 {%0, %1, %2, %3}, [%4];"
                 : "=r"(w[0]), "=r"(w[1]), "=r"(w[2]), "=r"(w[3])
                 : "r"(tile + 16 * (lane() & 7 | (lane() & 8) << 1 | (lane() & 16) >> 1))
                 : "memory");
  else
    asm volatile("ldmatrix.sync.aligned.m8n8.x4.shared.b16 {%0, %1, %2, %3}, [%4];"
                 : "=r"(w[0]), "=r"(w[1]), "=r"(w[2]), "=r"(w[3])
                 : "r"(tile + 16 * lane())
                 : "memory");
  return left;
}

/// Sixteen inputs as a right factor: even columns have the high parts, odd ones the low parts.
struct RightInputs {
  unsigned words[2];
};

/// The inputs of the lanes from `first` on, which `word` holds as HalfPair.
__device__ inline RightInputs right_inputs(unsigned word, int first) {
  constexpr unsigned all = 0xffffffffu;
  const int t = first + 2 * (lane() % 4);
  const unsigned select = lane() & 4 ? 0x7632 : 0x5410;
  RightInputs right;
#pragma unroll
  for (int k = 0; k < 2; ++k) {
    const unsigned even = __shfl_sync(all, word, t + 8 * k), odd = __shfl_sync(all, word, t + 8 * k + 1);
    right.words[k] = __byte_perm(even, odd, select);
  }
  return right;
}

/// sum += left * right. A lane has two columns of the rows lane() / 4 and eight below it.
__device__ inline void add_tile_product(float (&sum)[4], const LeftTileHalf& left, const RightInputs& right) {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
#pragma unroll
  for (int k = 0; k < 2; ++k)
    asm("mma.sync.aligned.m16n8k8.row.col.f32.f16.f16.f32 {%0, %1, %2, %3}, {%4, %5}, {%6}, {%0, %1, %2, %3};"
        : "+f"(sum[0]), "+f"(sum[1]), "+f"(sum[2]), "+f"(sum[3])
        : "r"(left.words[2 * k]), "r"(left.words[2 * k + 1]), "r"(right.words[k]));
#else
  asm("mma.sync.aligned.m16n8k16.row.col.f32.f16.f16.f32 {%0, %1, %2, %3}, {%4, %5, %6, %7}, {%8, %9}, "
      "{%0, %1, %2, %3};"
      : "+f"(sum[0]), "+f"(sum[1]), "+f"(sum[2]), "+f"(sum[3])
      : "r"(left.words[0]), "r"(left.words[1]), "r"(left.words[2]), "r"(left.words[3]), "r"(right.words[0]),
        "r"(right.words[1]));
#endif
}

/// The largest of one number a lane, not negative.
__device__ inline float largest_of_warp(float number) {
  constexpr unsigned all = 0xffffffffu;
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
  for (int offset = 16; offset > 0; offset /= 2) {
    const float other = __shfl_xor_sync(all, number, offset);
    number = other <= number ? number : other;
  }
  return number;
#else
  // Numbers that are not negative are in the order of their bits.
  return __uint_as_float(__reduce_max_sync(all, __float_as_uint(number)));
#endif
}

/// A power of two for numbers up to `largest`, and one over it: so that they fit in half precision, and what
/// is lost of the small ones is a 2^-32nd of the largest.
struct HalfScale {
  float to, back;

  __device__ explicit HalfScale(float largest) {
    constexpr int bias = 127, room = 8;  // up to 2^9
    const int exponent = max(static_cast<int>(__float_as_uint(largest) >> 23), room + 1);
    to = __uint_as_float(static_cast<unsigned>(2 * bias + room - exponent) << 23);
    back = __uint_as_float(static_cast<unsigned>(exponent - room) << 23);
  }
};

}  // namespace flash::sim::cuda
