#pragma once
#include <cuda_fp16.h>

namespace flash::sim::cuda {

// Numbers of a factor as they are stored, in single or half precision; arithmetic is in single precision.

__device__ inline float4 load_four(const float* numbers) { return *reinterpret_cast<const float4*>(numbers); }
__device__ inline float4 load_four(const __half* numbers) {
  const uint2 bits = *reinterpret_cast<const uint2*>(numbers);
  const float2 low = __half22float2(*reinterpret_cast<const __half2*>(&bits.x)),
               high = __half22float2(*reinterpret_cast<const __half2*>(&bits.y));
  return {low.x, low.y, high.x, high.y};
}
__device__ inline void store_four(const float4& four, float* to) { *reinterpret_cast<float4*>(to) = four; }
__device__ inline void store_four(const float4& four, __half* to) {
  const __half2 low = __floats2half2_rn(four.x, four.y), high = __floats2half2_rn(four.z, four.w);
  *reinterpret_cast<uint2*>(to) = {*reinterpret_cast<const unsigned*>(&low),
                                   *reinterpret_cast<const unsigned*>(&high)};
}

}  // namespace flash::sim::cuda
