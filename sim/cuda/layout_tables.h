#pragma once
#include "sim/cuda/layout/sheet_layout.h"
#include "sim/cuda/sheet_tables.h"

namespace flash::sim::cuda {

/// The four numbers of the lanes of a step: two of each lane, then the other two. So what a warp reads at
/// once, sixteen bytes a lane, lies together.
std::vector<double> by_halves(const std::vector<double>& steps);

/// The columns of a lane in steps_together steps, one behind the other.
std::vector<StepColumns> by_steps_together(const std::vector<int>& columns);

/// As which the weight of a vertex counts where it is judged, at least [m^2].
double least_area_of(const SheetLayout& layout);

/// Sets what tables have of the bending of a layout. `upload(numbers)`: where a kernel finds those of a
/// vector.
template <typename Upload>
void put_bending(const SheetLayout& layout, const Upload& upload, SheetTables& sheet) {
  sheet.bundle_count = static_cast<int>(layout.bundle_starts.size()) - 1;
  sheet.group_rows = upload(layout.group_rows);
  sheet.bundle_starts = upload(layout.bundle_starts);
  sheet.step_columns = upload(by_steps_together(layout.step_columns));
  sheet.step_values = upload(by_halves(layout.step_values));
  sheet.single_step_values = upload(std::vector<float>(layout.step_values.begin(), layout.step_values.end()));
  sheet.stand_in = upload(std::vector<float>(layout.stand_in.begin(), layout.stand_in.end()));
  sheet.hinge_count = layout.hinge_count;
  sheet.hinge_vertices = upload(layout.hinge_vertices);
  sheet.hinge_weights = upload(layout.hinge_weights);
  sheet.hinge_rest_angles = upload(layout.hinge_rest_angles);
  sheet.hinge_rest_areas = upload(layout.hinge_rest_areas);
  sheet.hinge_corner_starts = upload(layout.hinge_corner_starts);
  sheet.hinge_corners = upload(layout.hinge_corners);
  sheet.hinge_source_starts = upload(layout.hinge_source_starts);
  sheet.hinge_sources = upload(layout.hinge_sources);
}

/// Sets all that tables have of a layout.
template <typename Upload>
void put_layout(const SheetLayout& layout, const Upload& upload, SheetTables& sheet) {
  sheet.size = layout.size;
  sheet.triangle_count = layout.triangle_count;
  sheet.block_count = layout.block_count;
  sheet.triangle_vertices = upload(layout.triangle_vertices);
  sheet.gradients = upload(layout.gradients);
  sheet.areas = upload(layout.areas);
  sheet.corner_starts = upload(layout.corner_starts);
  sheet.corners = upload(layout.corners);
  sheet.pair_sources = upload(layout.pair_sources);
  sheet.slice_sources = upload(layout.slice_sources);
  sheet.block_rows = upload(layout.block_rows);
  sheet.block_columns = upload(layout.block_columns);
  sheet.slice_starts = upload(layout.slice_starts);
  sheet.slice_columns = upload(layout.slice_columns);
  sheet.vertex_area = upload(layout.vertex_area);
  sheet.least_area = least_area_of(layout);
  sheet.edge_count = static_cast<int>(layout.edge_lengths.size());
  sheet.edge_lengths = upload(layout.edge_lengths);
  put_bending(layout, upload, sheet);
}

}  // namespace flash::sim::cuda
