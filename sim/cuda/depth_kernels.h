#pragma once
#include <cuda_runtime.h>

#include <span>

#include "sim/cuda/depth_drawing.cuh"

namespace flash::sim::cuda {

/// Triangles that wait for many threads together, in the memory of the device.
struct LargeTriangles {
  LargeTriangle* triangles;  ///< room for all triangles of all pictures of a batch
  unsigned* count;
};

/// Queues the drawing of a batch. `meshes`: those of the batch, as the host has them.
void draw_pictures(const PictureBatch& batch, std::span<const DrawnMesh> meshes, const LargeTriangles& large,
                   cudaStream_t stream);

}  // namespace flash::sim::cuda
