#pragma once
#include "sim/cuda/four.h"
#include "sim/cuda/layout/edge_sources.h"
#include "sim/cuda/sheet_tables.h"
#include "sim/cuda/team.cuh"

namespace flash::sim::cuda {

// The scalar rows by one thread (scalar_rows.cuh): it goes through the lanes that the tables are laid out
// for.

inline constexpr int table_lanes = 4 * bundle_groups;

inline void write_slice_block(const float (&block)[9], int lane, float* slice, float*) {
  for (int e = 0; e < 9; ++e) slice[3 * slice_size * (e / 3) + 3 * lane + e % 3] = block[e];
}

/// There is no chip to send steps to.
struct StepRing {
  char* chip = nullptr;
  int depth = 0;
};

template <typename Number>
struct StepsInMemory {
  const Number* values;

  /// The numbers of a lane in a step: four rows of its column.
  Four<Number> rows(int step, int lane) const {
    const Number* of_step = values + 4L * table_lanes * step;
    if constexpr (sizeof(Number) == sizeof(double)) {
      const Number *upper = of_step + 2 * lane, *lower = upper + 2 * table_lanes;
      return {upper[0], upper[1], lower[0], lower[1]};
    } else {
      const Number* own = of_step + 4 * lane;
      return {own[0], own[1], own[2], own[3]};
    }
  }
};

template <typename Number>
struct StepsOnTheirWay {
  StepsOnTheirWay(const SheetTables&, const Number*, const StepRing&) {}
  bool are_sent() const { return false; }
  const Number* values = nullptr;
  Four<Number> rows(int, int) const { return {}; }
};

template <typename Number, typename Source, typename Places, typename Write>
void multiply_scalar_rows(const SheetTables& tables, const Source& source, const Places& x,
                          const Write& write) {
  for (int i = 0; i < 3 * tables.size && tables.bundle_count == 0; ++i) write(i / 3, i % 3, Number{});
  for (int bundle = 0; bundle < tables.bundle_count; ++bundle) {
    Number sums[table_lanes][3] = {};  // of the row that the lane ends with
    for (int step = tables.bundle_starts[bundle]; step < tables.bundle_starts[bundle + 1]; ++step)
      for (int lane = 0; lane < table_lanes; ++lane) {
        const StepColumns& columns = tables.step_columns[table_lanes * (step / steps_together) + lane];
        const auto vertex = x(columns.of[step % steps_together]);
        const Four<Number> own = source.rows(step, lane);
        const Number rows[4] = {own.x, own.y, own.z, own.w};
        for (int row = 0; row < 4; ++row) {
          Number* sum = sums[lane / 4 * 4 + row];
          sum[0] += rows[row] * vertex.x;
          sum[1] += rows[row] * vertex.y;
          sum[2] += rows[row] * vertex.z;
        }
      }
    for (int lane = 0; lane < table_lanes; ++lane)
      if (const int row = tables.group_rows[table_lanes * bundle + lane]; row >= 0)
        for (int c = 0; c < 3; ++c) write(row, c, sums[lane][c]);
  }
}

}  // namespace flash::sim::cuda
