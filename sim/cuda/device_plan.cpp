#include "sim/cuda/device_plan.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <string>

#include "sim/cuda/layout/solve_plan.h"
#include "sim/cuda/most_vertices.h"
#include "sim/law/least_weight.h"

namespace flash::sim::cuda {

FrontSettings fitting_fronts(FrontSettings settings) {
  constexpr int tile = 1024, number = sizeof(float),
                rest = block_warps * tile + common_memory / number + 64;  // numbers
  settings.panel_capacity = std::min(settings.panel_capacity, most_memory() / number - rest);
  return settings;
}

namespace {

/// The four numbers of the lanes of a step: two of each lane, then the other two. So what a warp reads at
/// once, sixteen bytes a lane, lies together.
std::vector<double> by_halves(const std::vector<double>& steps) {
  constexpr std::size_t lanes = 4 * bundle_groups;
  std::vector<double> halves(steps.size());
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const std::size_t step = k / (4 * lanes), lane = k / 4 % lanes, number = k % 4;
    halves[4 * lanes * step + 2 * lanes * (number / 2) + 2 * lane + number % 2] = steps[k];
  }
  return halves;
}

std::vector<StepColumns> by_steps_together(const std::vector<int>& columns) {
  constexpr std::size_t lanes = 4 * bundle_groups;
  std::vector<StepColumns> together(columns.size() / steps_together);
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const std::size_t step = k / lanes;
    together[lanes * (step / steps_together) + k % lanes].of[step % steps_together] =
        static_cast<unsigned short>(columns[k]);
  }
  return together;
}

}  // namespace

DeviceBending::DeviceBending(const SheetLayout& layout)
    : bundle_count_(static_cast<int>(layout.bundle_starts.size()) - 1),
      hinge_count_(layout.hinge_count),
      group_rows_(layout.group_rows),
      bundle_starts_(layout.bundle_starts),
      step_columns_(by_steps_together(layout.step_columns)),
      step_values_(by_halves(layout.step_values)),
      hinge_weights_(layout.hinge_weights),
      hinge_rest_angles_(layout.hinge_rest_angles),
      hinge_rest_areas_(layout.hinge_rest_areas),
      single_step_values_(std::vector<float>(layout.step_values.begin(), layout.step_values.end())),
      stand_in_(std::vector<float>(layout.stand_in.begin(), layout.stand_in.end())),
      hinge_vertices_(layout.hinge_vertices),
      hinge_corner_starts_(layout.hinge_corner_starts),
      hinge_corners_(layout.hinge_corners),
      hinge_source_starts_(layout.hinge_source_starts),
      hinge_sources_(layout.hinge_sources) {}

void DeviceBending::put(SheetTables& sheet) const {
  sheet.bundle_count = bundle_count_;
  sheet.group_rows = group_rows_.data();
  sheet.bundle_starts = bundle_starts_.data();
  sheet.step_columns = step_columns_.data();
  sheet.step_values = step_values_.data();
  sheet.single_step_values = single_step_values_.data();
  sheet.stand_in = stand_in_.data();
  sheet.hinge_count = hinge_count_;
  sheet.hinge_vertices = hinge_vertices_.data();
  sheet.hinge_weights = hinge_weights_.data();
  sheet.hinge_rest_angles = hinge_rest_angles_.data();
  sheet.hinge_rest_areas = hinge_rest_areas_.data();
  sheet.hinge_corner_starts = hinge_corner_starts_.data();
  sheet.hinge_corners = hinge_corners_.data();
  sheet.hinge_source_starts = hinge_source_starts_.data();
  sheet.hinge_sources = hinge_sources_.data();
}

template <typename Number>
const Number* DevicePlan::upload(const std::vector<Number>& numbers,
                                 std::vector<DeviceArray<Number>>& arrays) {
  arrays.emplace_back(numbers);
  return arrays.back().data();
}

DevicePlan::DevicePlan(const FrontPlan& plan, const SheetLayout& layout) : bending_(layout) {
  if (layout.size > most_vertices)
    throw std::invalid_argument("more than " + std::to_string(most_vertices) + " vertices");
  fronts.size = plan.size;
  fronts.level_count = static_cast<int>(plan.levels.size());
  fronts.shared_panel = plan.shared_panel;
  constexpr int room_for_two = 160 * 1024;  // chunks of a warp, with their tables, and two parts a number
  fronts.solve_depth = most_memory() >= room_for_two ? 2 : 1;
  fronts.factor_tiles = plan.factor_tiles;
  fronts.update_size = plan.update_size;
  fronts.fronts = upload(plan.fronts, fronts_);
  fronts.levels = upload(plan.levels, levels_);
  fronts.panel_rows = upload(plan.panel_rows, ints_);
  fronts.blocks = upload(plan.blocks, places_);

  sheet.size = layout.size;
  sheet.triangle_count = layout.triangle_count;
  sheet.block_count = layout.block_count;
  sheet.triangle_vertices = upload(layout.triangle_vertices, ints_);
  sheet.gradients = upload(layout.gradients, doubles_);
  sheet.areas = upload(layout.areas, doubles_);
  sheet.corner_starts = upload(layout.corner_starts, ints_);
  sheet.corners = upload(layout.corners, ints_);
  sheet.pair_sources = upload(layout.pair_sources, sources_);
  sheet.slice_sources = upload(layout.slice_sources, sources_);
  sheet.block_rows = upload(layout.block_rows, ints_);
  sheet.block_columns = upload(layout.block_columns, ints_);
  sheet.slice_starts = upload(layout.slice_starts, ints_);
  sheet.slice_columns = upload(layout.slice_columns, ints_);
  sheet.vertex_area = upload(layout.vertex_area, doubles_);
  sheet.least_area = least_vertex_share *
                     std::accumulate(layout.vertex_area.begin(), layout.vertex_area.end(), 0.0) / layout.size;
  sheet.edge_count = static_cast<int>(layout.edge_lengths.size());
  sheet.edge_lengths = upload(layout.edge_lengths, doubles_);
  bending_.put(sheet);
}

FrontTables DevicePlan::shared_out(const FrontPlan& plan, int team_blocks) {
  const SolvePlan solve = plan_solve(plan, team_blocks);
  FrontTables shared = fronts;
  shared.chunks = upload(solve.chunks, chunks_);
  shared.chunk_starts = upload(solve.starts, ints_);
  shared.gathers = upload(solve.gathers, gathers_);
  shared.parted = upload(solve.parted, gathers_);
  shared.parted_count = static_cast<int>(solve.parted.size());
  shared.vector_size = solve.vector_size;
  return shared;
}

}  // namespace flash::sim::cuda
