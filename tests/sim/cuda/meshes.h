#pragma once
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "data/procedural_mesh.h"
#include "sim/plan/sheet_plan.h"

namespace flash::sim::cuda {

using NamedPlan = std::pair<std::string, std::shared_ptr<const SheetPlan>>;

/// A grid, a Delaunay mesh and a disc, and sheets smaller than a leaf.
inline std::vector<NamedPlan> small_plans() {
  const auto plan = [](const data::TriangleMesh& mesh) { return make_sheet_plan(make_sheet(mesh)); };
  const auto grid = [](int x, int y) {
    return data::rectangle({.width = 0.02 * x, .height = 0.02 * y, .cells_x = x, .cells_y = y});
  };
  return {{"one cell", plan(grid(1, 1))},
          {"strip", plan(grid(20, 1))},
          {"grid", plan(grid(10, 12))},
          {"Delaunay", plan(data::delaunay_rectangle(0.2, 0.15, 0.018, 3))},
          {"disc", plan(data::disc(0.1, 0.02))}};
}

}  // namespace flash::sim::cuda
