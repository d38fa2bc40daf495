#pragma once
#include "sim/cuda/team.cuh"

namespace flash::sim::cuda {

/// A value that the threads of a block have in common, on chip. What a function takes by reference would else
/// be a copy for each thread, in memory: half a megabyte for a block, beside a first-level cache of 28 KB.
template <typename Value>
struct CommonValue {
  alignas(16) char bytes[sizeof(Value)];

  __device__ Value& get() { return *reinterpret_cast<Value*>(bytes); }
  /// change(value) by one thread, which the others see.
  template <typename Change>
  __device__ Value& write(const Change& change) {
    __syncthreads();
    if (threadIdx.x == 0) change(get());
    __syncthreads();
    return get();
  }
};

}  // namespace flash::sim::cuda
