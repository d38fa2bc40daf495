#pragma once
#include <vector>

#include "data/mesh/mesh.h"
#include "sim/cpu/block_pattern.h"
#include "sim/cuda/layout/front_layout.h"

namespace flash::sim::cuda {

/// The elimination of a pattern for teams of threads: what depends on the mesh alone. Fronts go by height,
/// the leaves first, the dearest of a height first.
struct FrontPlan {
  int size = 0;               ///< vertices
  std::vector<int> position;  ///< vertex -> elimination position
  std::vector<FrontLayout> fronts;
  std::vector<FrontLevel> levels;
  std::vector<int> rows;        ///< positions, ascending in each front
  std::vector<int> child_rows;  ///< place of a front's vertex below those of its child, -1 where it is none
  /// Of each front with children four lists over its mapped_rows on chip: the row's place in the update
  /// matrix of each child, -1 where it has none, and where the column of that place begins, 0 where it has
  /// none.
  std::vector<int> panel_rows;
  std::vector<int> entries;  ///< of each row of a front: number of its entry in a vector, -1 in padding
  std::vector<BlockPlace> blocks;

  /// Where the vector of a solve holds a zero.
  int nothing_passed() const { return 6 * size; }
  int factor_tiles = 0;     ///< stored of an environment's factor
  long update_size = 0;     ///< for update matrices
  int shared_panel = 0;     ///< numbers of on-chip memory for the panels of a level
  long factor_entries = 0;  ///< that are not zero by structure
  double factor_flops = 0;  ///< additions and multiplications of a factorization with its inverses
};

struct FrontSettings {
  int leaf_size = 10;             ///< vertices, at most, of a front without children
  int panel_capacity = 40000;     ///< numbers of on-chip memory that a team has for panels
  int most_groups = block_warps;  ///< of a team in a factorization
};

/// `places` of the vertices guide the order (dissection.h). Fronts too large for `panel_capacity` become
/// chains of smaller ones.
FrontPlan plan_fronts(const BlockPattern& pattern, const data::Points& places,
                      const FrontSettings& settings = {});

}  // namespace flash::sim::cuda
