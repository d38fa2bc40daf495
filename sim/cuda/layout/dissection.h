#pragma once
#include <array>
#include <vector>

#include "data/mesh/mesh.h"
#include "sim/cpu/block_pattern.h"

namespace flash::sim::cuda {

/// Vertices that are eliminated together, after those of the children.
struct DissectionNode {
  std::vector<int> vertices;
  std::array<int, 2> children = {-1, -1};  ///< nodes, -1 for none
};

/// Nested dissection (George 1973) of a pattern by the places of its vertices: halves across one of the axes,
/// whichever has the smaller separator, until at most `leaf_size` vertices are left. The tree is as low as it
/// can be, which minimum degree's is not: fronts of one height run side by side. Children come before their
/// parent; the last node is the root.
std::vector<DissectionNode> dissect(const BlockPattern& pattern, const data::Points& places, int leaf_size);

}  // namespace flash::sim::cuda
