#pragma once
#include "sim/cuda/team.cuh"

namespace flash::sim::cuda {

/// change() by one thread of a block, of what its threads have in common: behind all that they read before,
/// and before all that they read next.
template <typename Change>
__device__ void change_common(const Change& change) {
  synchronize_block();
  if (block_rank() == 0) change();
  synchronize_block();
}

/// A value that the threads of a block have in common, on chip. What a function takes by reference would else
/// be a copy for each thread, in memory: half a megabyte for a block, beside a first-level cache of 28 KB.
template <typename Value>
struct CommonValue {
  alignas(16) char bytes[sizeof(Value)];

  __device__ Value& get() { return *reinterpret_cast<Value*>(bytes); }
  /// change(value) by one thread, which the others see.
  template <typename Change>
  __device__ Value& write(const Change& change) {
    change_common([&] { change(get()); });
    return get();
  }
};

}  // namespace flash::sim::cuda
