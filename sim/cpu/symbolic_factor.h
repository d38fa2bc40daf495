#pragma once
#include <memory>
#include <vector>

#include "sim/cpu/block_pattern.h"
#include "sim/cpu/kernels.h"

namespace flash::sim {

/// Ordering, elimination tree and supernodes of a pattern, computed once a mesh and shared by all
/// environments and threads.
struct SymbolicFactor {
  std::vector<int> position;  ///< where each vertex comes in the elimination
  // The arrays that FrontTree points to.
  std::vector<Front> fronts;
  std::vector<int> rows, rows_in_parent, children;
  std::vector<FrontBlock> blocks;
  long entries = 0;          ///< numbers of L
  long factor_size = 0;      ///< numbers of the factor, with the padding
  long stack_size = 0;       ///< numbers of the update matrices that wait for their parents at a time
  long largest_columns = 0;  ///< numbers of the largest front's columns, with the padding
  int largest_front = 0;     ///< padded rows

  FrontTree tree() const {
    return {static_cast<int>(fronts.size()), fronts.data(),   rows.data(),
            rows_in_parent.data(),           children.data(), blocks.data()};
  }
};

/// Approximate minimum degree on the vertex graph (three unknowns a vertex stay together), fundamental
/// supernodes, those merged that are worth it.
std::shared_ptr<const SymbolicFactor> analyze(const BlockPattern& pattern);

}  // namespace flash::sim
