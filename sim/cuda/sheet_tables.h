#pragma once
#include "sim/cuda/layout/edge_sources.h"

namespace flash::sim::cuda {

/// The columns of a lane in steps_together steps of the scalar rows.
struct alignas(8) StepColumns {
  unsigned short of[steps_together];
};

/// A SheetLayout in the memory of a device.
struct SheetTables {
  int size, triangle_count, block_count, bundle_count;
  const int* triangle_vertices;
  const double *gradients, *areas;
  const int *corner_starts, *corners;
  const EdgeSources *pair_sources, *slice_sources;
  const int *block_rows, *block_columns;
  const int *slice_starts, *slice_columns;
  const int *group_rows, *bundle_starts;
  const StepColumns* step_columns;  ///< one a lane and steps_together steps
  const double* step_values;        ///< of a step, the first two numbers of each lane and then the others
  const float *single_step_values, *stand_in;
  const double* vertex_area;
  double least_area;  ///< as which the weight of a vertex counts where it is judged, at least [m^2]
  int edge_count;     ///< the first pairs
  const double* edge_lengths;
  int hinge_count;
  const int* hinge_vertices;
  const double *hinge_weights, *hinge_rest_angles, *hinge_rest_areas;
  const int *hinge_corner_starts, *hinge_corners;
  const int *hinge_source_starts, *hinge_sources;
};

}  // namespace flash::sim::cuda
