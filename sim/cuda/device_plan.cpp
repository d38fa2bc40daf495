#include "sim/cuda/device_plan.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "sim/cuda/layout/solve_plan.h"
#include "sim/cuda/layout_tables.h"
#include "sim/cuda/most_vertices.h"

namespace flash::sim::cuda {

FrontSettings fitting_fronts(FrontSettings settings) {
  constexpr int tile = 1024, number = sizeof(float),
                rest = block_warps * tile + common_memory / number + 64;  // numbers
  settings.panel_capacity = std::min(settings.panel_capacity, most_memory() / number - rest);
  return settings;
}

DeviceBending::DeviceBending(const SheetLayout& layout) {
  put_bending(
      layout, [&](const auto& numbers) { return vectors_.upload(numbers); }, tables_);
}

SheetTables DeviceBending::in(SheetTables sheet) const {
  sheet.bundle_count = tables_.bundle_count;
  sheet.group_rows = tables_.group_rows;
  sheet.bundle_starts = tables_.bundle_starts;
  sheet.step_columns = tables_.step_columns;
  sheet.step_values = tables_.step_values;
  sheet.single_step_values = tables_.single_step_values;
  sheet.stand_in = tables_.stand_in;
  sheet.hinge_count = tables_.hinge_count;
  sheet.hinge_vertices = tables_.hinge_vertices;
  sheet.hinge_weights = tables_.hinge_weights;
  sheet.hinge_rest_angles = tables_.hinge_rest_angles;
  sheet.hinge_rest_areas = tables_.hinge_rest_areas;
  sheet.hinge_corner_starts = tables_.hinge_corner_starts;
  sheet.hinge_corners = tables_.hinge_corners;
  sheet.hinge_source_starts = tables_.hinge_source_starts;
  sheet.hinge_sources = tables_.hinge_sources;
  return sheet;
}

DevicePlan::DevicePlan(const FrontPlan& plan, const SheetLayout& layout) {
  if (layout.size > most_vertices)
    throw std::invalid_argument("more than " + std::to_string(most_vertices) + " vertices");
  fronts.size = plan.size;
  fronts.level_count = static_cast<int>(plan.levels.size());
  fronts.shared_panel = plan.shared_panel;
  constexpr int room_for_two = 160 * 1024;  // chunks of a warp, with their tables, and two parts a number
  fronts.solve_depth = most_memory() >= room_for_two ? 2 : 1;
  fronts.factor_tiles = plan.factor_tiles;
  fronts.update_size = plan.update_size;
  fronts.fronts = vectors_.upload(plan.fronts);
  fronts.levels = vectors_.upload(plan.levels);
  fronts.panel_rows = vectors_.upload(plan.panel_rows);
  fronts.blocks = vectors_.upload(plan.blocks);
  put_layout(
      layout, [&](const auto& numbers) { return vectors_.upload(numbers); }, sheet);
}

FrontTables DevicePlan::shared_out(const FrontPlan& plan, int team_blocks) {
  const SolvePlan solve = plan_solve(plan, team_blocks);
  FrontTables shared = fronts;
  shared.chunks = vectors_.upload(solve.chunks);
  shared.chunk_starts = vectors_.upload(solve.starts);
  shared.gathers = vectors_.upload(solve.gathers);
  shared.parted = vectors_.upload(solve.parted);
  shared.parted_count = static_cast<int>(solve.parted.size());
  shared.vector_size = solve.vector_size;
  return shared;
}

}  // namespace flash::sim::cuda
