#pragma once

/// Marks a formula that stands once for host and device code.
#ifdef __CUDACC__
#define FLASH_HOST_DEVICE __host__ __device__
#else
#define FLASH_HOST_DEVICE
#endif
