#pragma once
#include "sim/cuda/team.cuh"

namespace flash::sim::cuda {

// Matrix products by tensor cores, as exact as single precision: each number is split into two of eleven
// significant bits, and of the four products of such parts all are added up but the smallest. A warp holds a
// matrix in fragments, g = lane / 4 and t = lane % 4: of a left factor of 16 x 8 the rows g and g + 8 in the
// columns t and t + 4, of a right factor of 8 x 8 the column g in the rows t and t + 4, of a product of 16 x
// 8 the rows g and g + 8 in the columns 2 t and 2 t + 1.

#if defined(__CUDACC__) && (!defined(__CUDA_ARCH__) || __CUDA_ARCH__ >= 800)
#define FLASH_TENSOR_CORES
#endif

/// x = high + low to 22 bits or more.
struct Split {
  unsigned high, low;
};

#ifdef FLASH_TENSOR_CORES
__device__ inline Split split(float x) {
  unsigned high;
#if __CUDA_ARCH__ >= 900
  asm("cvt.rn.tf32.f32 %0, %1;" : "=r"(high) : "f"(x));
#else
  asm("cvt.rna.tf32.f32 %0, %1;" : "=r"(high) : "f"(x));
#endif
  return {high, __float_as_uint(x - __uint_as_float(high))};
}

__device__ inline void add_part_product(float (&sum)[4], const unsigned (&left)[4],
                                        const unsigned (&right)[2]) {
  asm("mma.sync.aligned.m16n8k8.row.col.f32.tf32.tf32.f32 {%0, %1, %2, %3}, {%4, %5, %6, %7}, {%8, %9}, "
      "{%0, %1, %2, %3};"
      : "+f"(sum[0]), "+f"(sum[1]), "+f"(sum[2]), "+f"(sum[3])
      : "r"(left[0]), "r"(left[1]), "r"(left[2]), "r"(left[3]), "r"(right[0]), "r"(right[1]));
}
#else
// Older devices multiply in single precision, number by number.
__device__ inline Split split(float x) { return {__float_as_uint(x), 0}; }

__device__ inline void add_part_product(float (&sum)[4], const unsigned (&left)[4],
                                        const unsigned (&right)[2]) {
  constexpr unsigned all = 0xffffffffu;
  const int row = lane() / 4 * 4, column = lane() % 4 * 8;
#pragma unroll
  for (int k = 0; k < 8; ++k) {
    const float upper = __uint_as_float(__shfl_sync(all, left[k / 4 * 2], row + k % 4)),
                lower = __uint_as_float(__shfl_sync(all, left[k / 4 * 2 + 1], row + k % 4));
#pragma unroll
    for (int j = 0; j < 2; ++j) {
      const float other = __uint_as_float(__shfl_sync(all, right[k / 4], column + 4 * j + k % 4));
      sum[j] += upper * other;
      sum[2 + j] += lower * other;
    }
  }
}
#endif

/// A fragment in its two parts.
template <int size>
struct Fragment {
  unsigned high[size], low[size];

  __device__ void set(int k, float x) {
    const Split parts = split(x);
    high[k] = parts.high;
    low[k] = parts.low;
  }
};
using LeftFragment = Fragment<4>;
using RightFragment = Fragment<2>;

__device__ inline void add_product(float (&sum)[4], const LeftFragment& left, const RightFragment& right) {
#ifdef FLASH_TENSOR_CORES
  add_part_product(sum, left.low, right.high);
  add_part_product(sum, left.high, right.low);
#endif
  add_part_product(sum, left.high, right.high);
}

/// 32 rows of eight columns as two left factors, of which a lane has the rows 4 g to 4 g + 3: `near` in
/// column t, `far` in column t + 4.
struct LeftTile {
  LeftFragment parts[2];

  __device__ LeftTile(const float4& near, const float4& far) {
    const float4 columns[2] = {near, far};
#pragma unroll
    for (int h = 0; h < 2; ++h) {
      parts[0].set(2 * h, columns[h].x);
      parts[0].set(2 * h + 1, columns[h].y);
      parts[1].set(2 * h, columns[h].z);
      parts[1].set(2 * h + 1, columns[h].w);
    }
  }
};

/// A product of 32 x 8 numbers, of which a lane has the rows 4 g to 4 g + 3 of the columns 2 t and 2 t + 1.
struct TileProduct {
  float sum[2][4] = {};

  __device__ void add(const LeftTile& left, float near, float far) {
    RightFragment right;
    right.set(0, near);
    right.set(1, far);
    add_product(sum[0], left.parts[0], right);
    add_product(sum[1], left.parts[1], right);
  }
  __device__ float4 rows(int column) const {
    return {sum[0][column], sum[0][2 + column], sum[1][column], sum[1][2 + column]};
  }
};

}  // namespace flash::sim::cuda
