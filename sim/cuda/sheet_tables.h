#pragma once
#include "sim/cuda/layout/edge_sources.h"

namespace flash::sim::cuda {

/// A SheetLayout in the memory of a device.
struct SheetTables {
  int size, triangle_count, block_count, group_count;
  const int* triangle_vertices;
  const double *gradients, *areas;
  const int *corner_starts, *corners;
  const EdgeSources *pair_sources, *slice_sources;
  const int* block_vertex;
  const int *slice_starts, *slice_columns;
  const int *group_rows, *group_starts, *group_columns;
  const double* group_values;
  const float *single_group_values, *stand_in;
  const double* vertex_area;
};

}  // namespace flash::sim::cuda
