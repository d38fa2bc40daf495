#pragma once
#include <vector>

#include "sim/cuda/layout/inverse_tree.h"

namespace flash::sim::cuda {

/// The tables of an InverseTree as solves read them, in one piece that fits on chip as it is.
struct SolveImage {
  SolveLayout layout;
  std::vector<char> tables;  ///< SolveLayout::right bytes
};

/// For teams of so many warps.
SolveImage make_solve_image(const InverseTree& tree, int warps);

}  // namespace flash::sim::cuda
