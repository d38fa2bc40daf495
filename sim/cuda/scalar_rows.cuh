#pragma once

// Products with the scalar rows of bending, and blocks of the block rows, as the lanes of a warp have them
// side by side (layout/sheet_layout.h).
#ifdef __CUDACC__
#include "sim/cuda/device_rows.cuh"
#else
#include "sim/cuda/serial_rows.h"
#endif

namespace flash::sim::cuda {

/// The same where `steps` may be without room on chip.
template <typename Number, typename Places, typename Write>
__device__ void multiply_scalar_rows(const SheetTables& tables, const Number* values,
                                     StepsOnTheirWay<Number>& steps, const Places& x, const Write& write) {
  if (steps.are_sent())
    multiply_scalar_rows<Number>(tables, steps, x, write);
  else
    multiply_scalar_rows<Number>(tables, StepsInMemory<Number>{values}, x, write);
}

}  // namespace flash::sim::cuda
