#pragma once
#include "sim/cuda/layout/front_layout.h"

namespace flash::sim::cuda {

// The team of a device (team.cuh): the threads of a block, or of a cluster of blocks, each on a processor of
// its own.

/// Four numbers that are read at once.
using Float4 = float4;

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

inline constexpr int warp_lanes = 32;

__device__ inline int lane() { return static_cast<int>(threadIdx.x % 32); }
__device__ inline int warp() { return static_cast<int>(threadIdx.x / 32); }

/// A thread's number among those of its block, and how many these are.
__device__ inline int block_rank() { return static_cast<int>(threadIdx.x); }
__device__ inline int block_size() { return block_threads; }

/// act(k) by thread k of a block, for each k below `count`, of which there are no more than threads.
template <typename Act>
__device__ void for_ranks_below(int count, const Act& act) {
  if (const int k = block_rank(); k < count) act(k);
}

/// act(lane) for each lane of a warp.
template <typename Act>
__device__ void for_lanes(const Act& act) {
  act(lane());
}

__device__ inline void synchronize_warp() { __syncwarp(); }
__device__ inline void synchronize_block() { __syncthreads(); }

/// What the lane has whose number differs in the bits of `offset`.
template <typename Number>
__device__ Number across_warp(Number value, int offset) {
  return __shfl_xor_sync(0xffffffffu, value, offset);
}

// A launch has the teams along x and the blocks of each, a cluster, along y.

__device__ inline int team_index() { return static_cast<int>(blockIdx.x); }
__device__ inline int block_of_team() { return static_cast<int>(blockIdx.y); }
__device__ inline int team_blocks() { return static_cast<int>(gridDim.y); }

// Warps of a team by turns of its blocks: so few vertices are spread over all of them.

__device__ inline int team_warp() { return warp() * team_blocks() + block_of_team(); }
__device__ inline int team_warps() { return block_warps * team_blocks(); }
__device__ inline int team_rank() { return 32 * team_warp() + lane(); }
__device__ inline int team_size() { return block_threads * team_blocks(); }

/// A barrier for the team, behind which each thread sees what the others wrote. Of a block one thread makes
/// visible to the other blocks what all of its threads wrote: that waits for what is under way, and takes
/// longer where every warp does it. racecheck takes no notice of a cluster's barrier: with FLASH_RACECHECK a
/// barrier of the block stands behind it too.
__device__ inline void synchronize_team() {
  __syncthreads();
  if (team_blocks() == 1) return;
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
  if (threadIdx.x == 0) asm volatile("fence.acq_rel.cluster;" ::: "memory");
  asm volatile("barrier.cluster.arrive.relaxed;\nbarrier.cluster.wait.acquire;" ::: "memory");
#endif
#ifdef FLASH_RACECHECK
  __syncthreads();
#endif
}

/// The same place on chip in a block of the team.
template <typename Number>
__device__ Number* in_block(Number* on_chip, [[maybe_unused]] int block) {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
  Number* there;
  asm("mapa.u64 %0, %1, %2;" : "=l"(there) : "l"(on_chip), "r"(block));
  return there;
#else
  return on_chip;
#endif
}

/// Writes a number to the same place on chip in all blocks of the team, of which there are a power of two: so
/// a few instructions do for any team. Its own block sees it behind a barrier of the block, the others behind
/// one of the team.
template <typename Number>
__device__ void put_in_all(Number* on_chip, const Number& value) {
  *on_chip = value;
#pragma unroll
  for (int half = 1; half < most_team_blocks; half *= 2)
    if (half < team_blocks())
#pragma unroll
      for (int k = half; k < 2 * half; ++k) *in_block(on_chip, block_of_team() ^ k) = value;
}

/// Takes numbers that no other thread gets, from what `counter` was on.
__device__ inline int take_numbers(int& counter, int count) { return atomicAdd(&counter, count); }

/// Whether any thread of the team has found what it looked for, to all. A barrier.
__device__ inline bool any_of_team(bool found) {
  const int in_own_block = __syncthreads_or(found);
  if (team_blocks() == 1) return in_own_block != 0;
  __shared__ int blocks[most_team_blocks];
  if (threadIdx.x == 0) put_in_all(blocks + block_of_team(), in_own_block);
  synchronize_team();
  int any = 0;
  for (int block = 0; block < team_blocks(); ++block) any |= blocks[block];
  synchronize_team();
  return any != 0;
}

/// Whole warps of a block that work on something of their own.
struct Group {
  int index, rank, size;

  /// One of `count`, a power of two.
  __device__ static Group of(int count) {
    const int size = block_threads / count, rank = static_cast<int>(threadIdx.x);
    return {rank / size, rank % size, size};
  }
  __device__ void synchronize() const {
    if (size == block_threads)
      __syncthreads();
    else if (size == 32)
      __syncwarp();
    else
      __barrier_sync_count(1 + index, size);
  }
};

}  // namespace flash::sim::cuda
