#pragma once
#include "sim/cuda/layout/front_layout.h"

namespace flash::sim::cuda {

/// A FrontPlan in the memory of a device.
struct FrontTables {
  int size, level_count, shared_panel, largest_columns, vector_size;
  long factor_size, update_size;
  const FrontLayout* fronts;
  const FrontLevel* levels;
  const int *child_rows, *panel_rows, *entries;
  const BlockPlace* blocks;
  const ForwardTask* forward;
  const BackwardTask* backward;
};

}  // namespace flash::sim::cuda
