#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <vector>

#include "sim/cuda/layout/front_layout.h"

// What a compiler of CUDA calls functions.
#ifndef __device__
#define __device__
#endif
#ifndef __host__
#define __host__
#endif
#ifndef __noinline__
#define __noinline__
#endif

namespace flash::sim::cuda {

// A team of one thread on the processor, in the words of device_team.cuh. Nothing waits for anything.

using std::atan2;
using std::hypot;
using std::isfinite;
using std::max;
using std::memcpy;
using std::min;
using std::remainder;

/// As the vector of CUDA.
struct alignas(16) Float4 {
  float x, y, z, w;
};

/// Bytes that stand for the memory on chip.
inline constexpr std::size_t serial_chip = 256 * 1024;

/// The memory on chip of the team that works on this thread.
inline char* serial_memory() {
  struct alignas(16) Sixteen {
    char bytes[16];
  };
  thread_local const std::unique_ptr<Sixteen[]> memory(new Sixteen[serial_chip / sizeof(Sixteen)]);
  return memory[0].bytes;
}

template <typename Number>
Number* shared_memory() {
  return reinterpret_cast<Number*>(serial_memory());
}

inline constexpr int warp_lanes = 1;

inline int lane() { return 0; }
inline int warp() { return 0; }
inline int block_rank() { return 0; }
inline int block_size() { return 1; }
inline int block_of_team() { return 0; }
inline int team_blocks() { return 1; }
inline int team_warp() { return 0; }
inline int team_warps() { return 1; }
inline int team_rank() { return 0; }
inline int team_size() { return 1; }

template <typename Act>
void for_ranks_below(int count, const Act& act) {
  for (int k = 0; k < count; ++k) act(k);
}

/// As many as a warp of a device has: tables are laid out for them.
template <typename Act>
void for_lanes(const Act& act) {
  constexpr int lanes_of_tables = 32;
  for (int k = 0; k < lanes_of_tables; ++k) act(k);
}

inline void synchronize_warp() {}
inline void synchronize_block() {}
inline void synchronize_team() {}

template <typename Number>
Number across_warp(Number value, int) {
  return value;
}

template <typename Number>
Number* in_block(Number* on_chip, int) {
  return on_chip;
}

template <typename Number>
void put_in_all(Number* on_chip, const Number& value) {
  *on_chip = value;
}

inline bool any_of_team(bool found) { return found; }

inline int take_numbers(int& counter, int count) {
  counter += count;
  return counter - count;
}

}  // namespace flash::sim::cuda
