#pragma once
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "data/mesh/procedural_mesh.h"
#include "sim/plan/sheet_plan.h"

namespace flash::sim::cuda {

/// So many copies of a mesh as one, which do not touch.
inline data::TriangleMesh side_by_side(const data::TriangleMesh& one, int count) {
  const Eigen::Index vertices = one.vertices.rows(), triangles = one.triangles.rows();
  data::TriangleMesh all;
  all.vertices.resize(count * vertices, 3);
  all.triangles.resize(count * triangles, 3);
  for (int k = 0; k < count; ++k) {
    all.vertices.middleRows(k * vertices, vertices) =
        one.vertices.rowwise() + Eigen::RowVector3d(0.5 * k, 0, 0);
    all.triangles.middleRows(k * triangles, triangles) =
        one.triangles.array() + static_cast<int>(k * vertices);
  }
  return all;
}

using NamedPlan = std::pair<std::string, std::shared_ptr<const SheetPlan>>;

/// A grid, a Delaunay mesh and a disc, sheets smaller than a leaf, and one of parts that are not joined.
inline std::vector<NamedPlan> small_plans() {
  const auto plan = [](const data::TriangleMesh& mesh) { return make_sheet_plan(make_sheet(mesh)); };
  const auto grid = [](int x, int y) {
    return data::rectangle({.width = 0.02 * x, .height = 0.02 * y, .cells_x = x, .cells_y = y});
  };
  return {{"one cell", plan(grid(1, 1))},
          {"strip", plan(grid(20, 1))},
          {"grid", plan(grid(10, 12))},
          {"Delaunay", plan(data::delaunay_rectangle(0.2, 0.15, 0.018, 3))},
          {"disc", plan(data::disc(0.1, 0.02))},
          {"five grids", plan(side_by_side(grid(6, 6), 5))}};
}

}  // namespace flash::sim::cuda
