#pragma once
#include <cuda_runtime.h>

namespace flash::sim::cuda {

// Memory on chip by its own addresses of 32 bits, which cost less to compute than pointers that may lead
// anywhere. What is copied in the background is not seen by the compiler, so that loads keep their order.

__device__ inline unsigned chip_address(const void* on_chip) {
  return static_cast<unsigned>(__cvta_generic_to_shared(on_chip));
}

// Devices before 8.0 have no copies in the background. racecheck takes those that a block has waited for to
// be under way still when another block of its team writes to the same place behind a barrier.
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800 || defined(FLASH_RACECHECK)
#define FLASH_PLAIN_COPIES
#endif

/// How the second-level cache is to treat what is read.
using CachePolicy = unsigned long long;

/// What is read with it leaves the cache first: numbers of which others are read before they come again.
__device__ inline CachePolicy leaves_first() {
  CachePolicy policy = 0;
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 800
  asm("createpolicy.fractional.L2::evict_first.b64 %0, 1.0;" : "=l"(policy));
#endif
  return policy;
}

/// Copies 16 bytes in the background, to be waited for with wait_for_copies; zeros where `bytes` is 0, and
/// not 16.
__device__ inline void copy_to_chip(unsigned to, const void* from, int bytes,
                                    [[maybe_unused]] CachePolicy policy) {
#if defined(FLASH_PLAIN_COPIES)
  *static_cast<int4*>(__cvta_shared_to_generic(to)) =
      bytes > 0 ? *static_cast<const int4*>(from) : int4{0, 0, 0, 0};
#else
  asm volatile("cp.async.cg.shared.global.L2::cache_hint [%0], [%1], 16, %2, %3;" ::"r"(to), "l"(from),
               "r"(bytes), "l"(policy)
               : "memory");
#endif
}

/// Copies 4, 8 or 16 bytes in the background, to be waited for with wait_for_copies.
template <int bytes>
__device__ inline void copy_to_chip(unsigned to, const void* from) {
  static_assert(bytes == 4 || bytes == 8 || bytes == 16);
#if defined(FLASH_PLAIN_COPIES)
  char* chip = static_cast<char*>(__cvta_shared_to_generic(to));
  for (int k = 0; k < bytes; k += 4)
    *reinterpret_cast<int*>(chip + k) = *reinterpret_cast<const int*>(static_cast<const char*>(from) + k);
#else
  if constexpr (bytes == 16)
    asm volatile("cp.async.cg.shared.global [%0], [%1], 16;" ::"r"(to), "l"(from) : "memory");
  else
    asm volatile("cp.async.ca.shared.global [%0], [%1], %2;" ::"r"(to), "l"(from), "n"(bytes) : "memory");
#endif
}

/// Ends a group of copies.
__device__ inline void end_copies() {
#if !defined(__CUDA_ARCH__) || __CUDA_ARCH__ >= 800
  asm volatile("cp.async.commit_group;" ::: "memory");
#endif
}

/// Waits for the thread's copies, the last `groups` apart.
template <int groups>
__device__ inline void wait_for_copies() {
#if !defined(__CUDA_ARCH__) || __CUDA_ARCH__ >= 800
  asm volatile("cp.async.wait_group %0;" ::"n"(groups) : "memory");
#endif
}

__device__ inline int4 load_int4(unsigned at) {
  int4 v;
  asm volatile("ld.shared.v4.b32 {%0, %1, %2, %3}, [%4];"
               : "=r"(v.x), "=r"(v.y), "=r"(v.z), "=r"(v.w)
               : "r"(at)
               : "memory");
  return v;
}
__device__ inline int2 load_int2(unsigned at) {
  int2 v;
  asm volatile("ld.shared.v2.b32 {%0, %1}, [%2];" : "=r"(v.x), "=r"(v.y) : "r"(at) : "memory");
  return v;
}
__device__ inline int load_int(unsigned at) {
  int v;
  asm volatile("ld.shared.b32 %0, [%1];" : "=r"(v) : "r"(at) : "memory");
  return v;
}

}  // namespace flash::sim::cuda
