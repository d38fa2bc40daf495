#pragma once
#include "sim/cuda/front_invert.cuh"
#include "sim/cuda/front_panel.cuh"
#include "sim/cuda/front_update.cuh"

namespace flash::sim::cuda {

// The multifrontal Cholesky factorization of one environment by a team (Duff and Reid 1983; Liu 1992). A
// group of warps of a block owns a front: its columns [A11; A21] stand on chip. X = L11^-1 comes first; with
// it all else are products, without a barrier between them: L21 = A21 X^T, -L21 X to the factor, and the
// update matrix to memory, once. Bytes: blocks and factor once, lower update matrices out and in.

/// On-chip numbers of a factorization: the panels of a level, each with where its rows stand in the
/// children's update matrices, and a tile a warp.
__host__ __device__ inline int factor_memory(int shared_panel) {
  return shared_panel + block_warps * tile_numbers;
}

/// The factor of the matrix `blocks`, nine numbers a block of the pattern, column-major. `updates`: memory
/// for FrontTables::update_size numbers; `chip`: factor_memory on chip. Returns, to some threads at least,
/// whether all pivots were positive.
template <int parts>
__device__ bool factorize(const FrontTables& tables, const float* blocks, float* updates, __half* factor,
                          float* chip) {
  bool positive = true;
  const int blocks_of_team = team_blocks();
  float* tile = chip + tables.shared_panel + warp() * tile_numbers;
  for (int l = 0; l < tables.level_count; ++l) {
    synchronize_team();
    const FrontLevel level = tables.levels[l];
    // Several blocks need fewer groups each.
    int groups = level.groups;
    while (groups > 1 && groups * blocks_of_team >= 2 * level.front_count) groups /= 2;
    const Group group = Group::of(groups);
    for (int f = level.first_front + group.index * blocks_of_team + block_of_team();
         f < level.first_front + level.front_count; f += groups * blocks_of_team) {
      const FrontLayout front = tables.fronts[f];
      const int columns = 3 * front.column_count, own = padded_columns(columns), below = 3 * front.row_count;
      const Panel panel = {chip + group.index * (tables.shared_panel / groups / 4 * 4),
                           columns,
                           own,
                           below,
                           panel_leading(columns, below),
                           group};
      const int stride = mapped_rows(columns, below);
      int* places = reinterpret_cast<int*>(panel.numbers + own * panel.leading);
      const ChildRows rows = {places, places + 2 * stride, stride,
                              front.children[0] >= 0 || front.children[1] >= 0};
      if (rows.any) {
        load_rows(tables, front, group, rows);
        group.synchronize();
        gather_columns(panel, rows, updates);
      } else {
        clear_columns(panel);
      }
      group.synchronize();
      add_blocks(tables, front, blocks, panel);
      group.synchronize();
      positive = invert_own_block(panel) && positive;
      const FactorColumns<parts> to = {
          factor + static_cast<long>(front.first_tile) * parts * solve_tile_numbers, front.column_tiles};
      store_inverse(panel, to);
      const int warps = group.size / 32;
      for (int strip = group.rank / 32; 32 * strip < below; strip += warps) {
        make_strip(panel, strip);
        store_strip(front, panel, strip, to);
      }
      group.synchronize();
      make_update(front, panel, rows, updates, tile);
      group.synchronize();
    }
  }
  synchronize_team();
  return positive;
}

}  // namespace flash::sim::cuda
