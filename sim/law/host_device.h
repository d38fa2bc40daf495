#pragma once

/// Marks a formula that stands once for host and device code.
#ifdef __CUDACC__
#define FLASH_HOST_DEVICE __host__ __device__
/// One that kernels call instead of taking it in at each of many places, where it would be most of their
/// code.
#define FLASH_CALLED_ON_DEVICE __host__ __device__ __noinline__
#else
#define FLASH_HOST_DEVICE
#define FLASH_CALLED_ON_DEVICE
#endif

namespace flash::sim {

/// Whether what is compiled runs on a device.
#ifdef __CUDA_ARCH__
inline constexpr bool on_device = true;
#else
inline constexpr bool on_device = false;
#endif

}  // namespace flash::sim
