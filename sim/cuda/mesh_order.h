#pragma once
#include <cuda_runtime.h>

#include "sim/cuda/four.h"

namespace flash::sim::cuda {

/// Queues a copy of points, which stand by place, to `to`: environments x vertices x 3 in the order of the
/// mesh. `order`: vertex at each of `size` places.
void put_in_mesh_order(const Point* points, const int* order, int size, int environments, double* to,
                       cudaStream_t stream);

}  // namespace flash::sim::cuda
