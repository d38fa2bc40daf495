#include "sim/cuda/team_memory.h"

#include "sim/cuda/layout/front_layout.h"

namespace flash::sim::cuda {

TeamMemory lay_out_team(const TeamSizes& sizes, DeviceArena& arena) {
  const auto number = [](long count) { return static_cast<std::size_t>(count); };
  const std::size_t size = number(sizes.layout.size), triangles = number(sizes.layout.triangle_count),
                    hinges = number(sizes.hinges);
  TeamMemory m{};
  for (int k = 0; k < 3; ++k) {
    m.positions[k] = arena.take<Point>(size);
    m.forces[k] = arena.take<double>(3 * size);
  }
  for (float** vector : {&m.gradient, &m.direction, &m.change, &m.residual, &m.image})
    *vector = arena.take<float>(3 * size);
  m.solved = arena.take<float>(number(sizes.fronts.vector_size));
  m.search = arena.take<Four<float>>(size);
  m.shares = arena.take<float>(36 * triangles);
  m.updates = arena.take<float>(number(sizes.fronts.update_size));
  m.block_rows = arena.take<float>(number(sizes.layout.slice_starts.back()) * slice_numbers);
  m.blocks = arena.take<float>(9 * number(sizes.layout.block_count));
  m.triangle_gradients = arena.take<double>(9 * triangles);
  m.hinge_gradients = arena.take<double>(12 * hinges);
  m.hinge_matrix = arena.take<float>(12 * hinges);
  m.hinge_products = arena.take<float>(hinges);
  m.start_metrics = arena.take<double>(3 * triangles);
  m.start_angles = arena.take<double>(hinges);
  m.bent = arena.take<Point>(size);
  m.damped = arena.take<double>(3 * size);
  for (double*& residual : m.residuals) residual = arena.take<double>(3 * size);
  m.held_axes = arena.take<int>(size);
  m.restrictions = arena.take<VertexRestriction>(size);
  m.restriction_of = arena.take<int>(size);
  if (const std::size_t obstacles = number(sizes.most_obstacles); obstacles > 0) {
    const auto records = [&]<typename Record>(std::size_t layers) -> VertexRecords<Record> {
      return {arena.take<double>(VertexRecords<Record>::numbers_each * size * layers),
              static_cast<int>(size)};
    };
    for (ContactSet& contacts : m.contacts)
      contacts = {arena.take<int>(size), records.operator()<ContactRecord>(1),
                  records.operator()<TouchRecord>(obstacles), arena.take<double>(size)};
    m.projectors = arena.take<float>(6 * size);
    m.coupled = {arena.take<float>(9 * size), arena.take<float>(3 * size * (most_directions + 1)),
                 arena.take<float>(3 * size * most_directions), arena.take<double>(small_numbers)};
  }
  m.own_blocks = arena.take<float>(9 * size);
  m.hold_starts = arena.take<double>(3 * size);
  m.clocks = arena.take<long long>(replay_phases + 1);
  return m;
}

}  // namespace flash::sim::cuda
