#pragma once
#include "sim/cuda/layout/sheet_layout.h"
#include "sim/cuda/replay_numbers.h"

namespace flash::sim::cuda {

/// What a team of a replay needs memory for, with whatever holds and materials come.
struct TeamSizes {
  const FrontTables& fronts;
  const SheetLayout& layout;
  int hinges;  ///< of the plan: a material may come that has them
  int most_obstacles;
};

/// The memory of a team, arena.take<Number>(count) by arena.take<Number>(count).
template <typename Arena>
TeamMemory lay_out_team(const TeamSizes& sizes, Arena& arena) {
  const auto number = [](long count) { return static_cast<std::size_t>(count); };
  const std::size_t size = number(sizes.layout.size), triangles = number(sizes.layout.triangle_count),
                    hinges = number(sizes.hinges);
  TeamMemory m{};
  for (int k = 0; k < 3; ++k) {
    m.positions[k] = arena.template take<Point>(size);
    m.forces[k] = arena.template take<double>(3 * size);
  }
  for (float** vector : {&m.gradient, &m.direction, &m.change, &m.residual, &m.image})
    *vector = arena.template take<float>(3 * size);
  m.solved = arena.template take<float>(number(sizes.fronts.vector_size));
  m.search = arena.template take<Four<float>>(size);
  m.shares = arena.template take<float>(36 * triangles);
  m.updates = arena.template take<float>(number(sizes.fronts.update_size));
  m.block_rows = arena.template take<float>(number(sizes.layout.slice_starts.back()) * slice_numbers);
  m.blocks = arena.template take<float>(9 * number(sizes.layout.block_count));
  m.triangle_gradients = arena.template take<double>(9 * triangles);
  m.hinge_gradients = arena.template take<double>(12 * hinges);
  m.hinge_matrix = arena.template take<float>(12 * hinges);
  m.hinge_products = arena.template take<float>(hinges);
  m.start_metrics = arena.template take<double>(3 * triangles);
  m.start_angles = arena.template take<double>(hinges);
  m.bent = arena.template take<Point>(size);
  m.damped = arena.template take<double>(3 * size);
  for (double*& residual : m.residuals) residual = arena.template take<double>(3 * size);
  m.held_axes = arena.template take<int>(size);
  m.restrictions = arena.template take<VertexRestriction>(size);
  m.restriction_of = arena.template take<int>(size);
  if (const std::size_t obstacles = number(sizes.most_obstacles); obstacles > 0) {
    const auto records = [&]<typename Record>(std::size_t layers) -> VertexRecords<Record> {
      return {arena.template take<double>(VertexRecords<Record>::numbers_each * size * layers),
              static_cast<int>(size)};
    };
    for (ContactSet& contacts : m.contacts)
      contacts = {arena.template take<int>(size), records.template operator()<ContactRecord>(1),
                  records.template operator()<TouchRecord>(obstacles), arena.template take<double>(size)};
    m.projectors = arena.template take<float>(6 * size);
    m.coupled = {
        arena.template take<float>(9 * size), arena.template take<float>(3 * size * (most_directions + 1)),
        arena.template take<float>(3 * size * most_directions), arena.template take<double>(small_numbers)};
  }
  m.own_blocks = arena.template take<float>(9 * size);
  m.hold_starts = arena.template take<double>(3 * size);
  m.clocks = arena.template take<long long>(replay_phases + 1);
  return m;
}

}  // namespace flash::sim::cuda
