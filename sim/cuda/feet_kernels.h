#pragma once
#include <cuda_runtime.h>

#include "sim/law/surface_foot.h"

namespace flash::sim::cuda {

/// Triangles that a warp looks at together; their box tells whether it has to.
inline constexpr int group_triangles = 32;

/// Two of the steps that are on the device, and how far a surface stands from the first to the second.
struct SurfaceTime {
  int from, to;  ///< places among the steps
  double fraction;
};

/// What the search for feet knows: several surfaces of one mesh, each with a cloud of its own.
struct FeetNumbers {
  int surfaces, vertices, groups;
  const Vector3<int>*
      corners;  ///< of each slot, groups * group_triangles; the last triangle again at the end
  const Vector3<double>* steps;  ///< vertices one after the other, a step behind the other [m]
  const SurfaceTime* times;      ///< one a surface
  /// Of each surface: 9 numbers a slot, all first ones together, then the second ones: corner a, b - a, c -
  /// a.
  double* placed;
  double* boxes;  ///< of each surface: 6 numbers a group, in that order: least x, y, z, greatest x, y, z

  int points = 0;
  const Vector3<double>* cloud = nullptr;  ///< of all surfaces [m]
  const int* surface_of = nullptr;         ///< each point
  Frame<double> surface_from_cloud{};
  double steps_per_second = 0;
  SurfaceFoot* feet = nullptr;  ///< result, one a point
};

/// Queues both: places the surfaces at their times, then finds the foot of each point.
void place_and_search(const FeetNumbers& numbers, cudaStream_t stream);

}  // namespace flash::sim::cuda
