#pragma once
#include "sim/cuda/layout/front_layout.h"

namespace flash::sim::cuda {

// A team is the block of threads that works on one environment. What a thread computes for an entry never
// depends on how many threads, groups or environments there are: so a batch equals alone, bitwise.

/// On-chip memory of the block, as many bytes as the launch asked for.
template <typename Number>
__device__ Number* shared_memory() {
  extern __shared__ float4 block_memory[];
  return reinterpret_cast<Number*>(block_memory);
}

/// The same pointer into the device's memory, which the compiler does not take apart into base and offset
/// again: so the address of each number behind it takes one multiply-add.
template <typename Number>
__device__ inline Number* kept_whole(Number* pointer) {
#ifdef __CUDA_ARCH__
  asm("" : "+l"(pointer));
  __builtin_assume(__isGlobal(pointer));
#endif
  return pointer;
}

__device__ inline int lane() { return static_cast<int>(threadIdx.x % 32); }
__device__ inline int warp() { return static_cast<int>(threadIdx.x / 32); }

/// Whole warps of a team that work on something of their own.
struct Group {
  int index, rank, size;

  /// One of `count`, a power of two.
  __device__ static Group of(int count) {
    const int size = team_threads / count, rank = static_cast<int>(threadIdx.x);
    return {rank / size, rank % size, size};
  }
  __device__ void synchronize() const {
    if (size == team_threads)
      __syncthreads();
    else if (size == 32)
      __syncwarp();
    else
      __barrier_sync_count(1 + index, size);
  }
};

template <typename Number>
__device__ Number sum_over_warp(Number value) {
  for (int offset = 16; offset > 0; offset /= 2) value += __shfl_xor_sync(0xffffffffu, value, offset);
  return value;
}

/// On-chip numbers that sums over the team need: as many at once at most.
inline constexpr int most_sums = 12;

/// Sums of `count` values a thread, for all threads. `partial`: on-chip memory for as many a warp.
template <int count>
__device__ void sum_over_team(double (&values)[count], double* partial) {
  static_assert(count <= most_sums);
#pragma unroll
  for (int k = 0; k < count; ++k) values[k] = sum_over_warp(values[k]);
  __syncthreads();
  if (lane() == 0)
#pragma unroll
    for (int k = 0; k < count; ++k) partial[count * warp() + k] = values[k];
  __syncthreads();
#pragma unroll
  for (int k = 0; k < count; ++k) {
    values[k] = 0;
    for (int w = 0; w < team_warps; ++w) values[k] += partial[count * w + k];
  }
}

/// The sum of one value a thread, for all threads. `partial`: on-chip memory for a number a warp.
template <typename Number>
__device__ Number sum_over_team(Number value, Number* partial) {
  value = sum_over_warp(value);
  __syncthreads();
  if (lane() == 0) partial[warp()] = value;
  __syncthreads();
  Number sum = 0;
  for (int w = 0; w < team_warps; ++w) sum += partial[w];
  return sum;
}

/// The larger of two numbers, of which what is not a number counts as the largest.
__device__ inline double worse_of(double worst, double other) {
  return other <= worst || worst != worst ? worst : other;
}

/// The largest of one value a thread, not negative, for all threads; what is not a number counts as the
/// largest. `partial`: on-chip memory for a number a warp.
__device__ inline double worst_over_team(double value, double* partial) {
  for (int offset = 16; offset > 0; offset /= 2)
    value = worse_of(value, __shfl_xor_sync(0xffffffffu, value, offset));
  __syncthreads();
  if (lane() == 0) partial[warp()] = value;
  __syncthreads();
  double worst = 0;
  for (int w = 0; w < team_warps; ++w) worst = worse_of(worst, partial[w]);
  return worst;
}

}  // namespace flash::sim::cuda
