#include "sim/cuda/layout/inverse_tree.h"

#include <algorithm>
#include <set>

#include "sim/cuda/layout/dissection.h"

namespace flash::sim::cuda {
namespace {

int tiles_of(std::size_t numbers) { return (static_cast<int>(numbers) + inverse_tile - 1) / inverse_tile; }

/// A node as sets of vertices.
struct Merged {
  std::vector<int> own, below;
  int height, parent = -1;
};

/// The dissection with two heights of separators in one node, children before their parents.
std::vector<Merged> merged_nodes(const std::vector<DissectionNode>& binary) {
  const int count = static_cast<int>(binary.size());
  std::vector<int> depth(binary.size(), 0), of(binary.size(), -1);
  int deepest = 0;  // of separators
  for (int k = count - 1; k >= 0; --k)
    for (const int child : binary[k].children)
      if (child >= 0) {
        depth[child] = depth[k] + 1;
        deepest = std::max(deepest, depth[k]);
      }
  const auto is_leaf = [&](int k) { return binary[k].children[0] < 0 && binary[k].children[1] < 0; };
  std::vector<Merged> nodes;
  // From the root down; turned round at the end.
  std::vector<int> parent(binary.size(), -1);
  for (int k = count - 1; k >= 0; --k) {
    const bool joins = !is_leaf(k) && depth[k] % 2 == 1;
    if (joins) {
      of[k] = of[parent[k]];
      std::vector<int>& own = nodes[of[k]].own;
      own.insert(own.end(), binary[k].vertices.begin(), binary[k].vertices.end());
    } else {
      of[k] = static_cast<int>(nodes.size());
      const int height = is_leaf(k) ? 0 : deepest / 2 - depth[k] / 2 + 1;
      nodes.push_back({binary[k].vertices, {}, height, parent[k] < 0 ? -1 : of[parent[k]]});
    }
    for (const int child : binary[k].children)
      if (child >= 0) parent[child] = k;
  }
  // By height, and as they were.
  std::vector<int> order(nodes.size()), place(nodes.size());
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = static_cast<int>(order.size() - 1 - k);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return nodes[a].height < nodes[b].height; });
  for (std::size_t k = 0; k < order.size(); ++k) place[order[k]] = static_cast<int>(k);
  std::vector<Merged> sorted;
  for (const int k : order) {
    sorted.push_back(nodes[k]);
    if (nodes[k].parent >= 0) sorted.back().parent = place[nodes[k].parent];
  }
  return sorted;
}

/// Fills in which vertices are below each node.
void find_below(const BlockPattern& pattern, std::vector<Merged>& nodes) {
  std::vector<int> node_of(pattern.size);
  for (std::size_t k = 0; k < nodes.size(); ++k)
    for (const int vertex : nodes[k].own) node_of[vertex] = static_cast<int>(k);
  std::vector<std::set<int>> below(nodes.size());
  for (const auto& [a, b] : pattern.pairs) {
    if (node_of[a] < node_of[b]) below[node_of[a]].insert(b);
    if (node_of[b] < node_of[a]) below[node_of[b]].insert(a);
  }
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    nodes[k].below.assign(below[k].begin(), below[k].end());
    const int parent = nodes[k].parent;
    if (parent < 0) continue;
    for (const int vertex : below[k])
      if (node_of[vertex] != parent) below[parent].insert(vertex);
  }
}

}  // namespace

BlockPattern pattern_of(const Eigen::SparseMatrix<double>& matrix) {
  BlockPattern pattern{static_cast<int>(matrix.rows()), {}};
  for (int column = 0; column < matrix.outerSize(); ++column)
    for (Eigen::SparseMatrix<double>::InnerIterator entry(matrix, column); entry; ++entry)
      if (entry.row() > column) pattern.pairs.emplace_back(static_cast<int>(entry.row()), column);
  return pattern;
}

InverseTree plan_inverse(const BlockPattern& pattern, const data::Points& places, int leaf_size) {
  std::vector<Merged> merged = merged_nodes(dissect(pattern, places, leaf_size));
  find_below(pattern, merged);
  InverseTree tree;
  tree.size = pattern.size;
  tree.slot_of.resize(pattern.size);
  for (const Merged& node : merged) {
    InverseNode plan{tree.slots / inverse_tile,
                     tiles_of(node.own.size()),
                     static_cast<int>(tree.below.size()),
                     tiles_of(node.below.size()),
                     0,
                     tree.tiles};
    for (const int vertex : node.own) {
      tree.slot_of[vertex] = static_cast<int>(tree.vertex_at.size());
      tree.vertex_at.push_back(vertex);
    }
    tree.slots += inverse_tile * plan.column_tiles;
    tree.vertex_at.resize(tree.slots, -1);
    tree.below.resize(tree.below.size() + inverse_tile * plan.below_tiles, -1);
    tree.tiles += plan.column_tiles * plan.below_tiles;
    tree.products += plan.column_tiles * (plan.column_tiles + 2L * plan.below_tiles);
    tree.nodes.push_back(plan);
    tree.parents.push_back(node.parent);
  }
  for (InverseNode& node : tree.nodes) {
    node.first_D = tree.tiles;
    tree.tiles += node.column_tiles * node.column_tiles;
  }
  std::vector<std::vector<int>> gathered(tree.slots);
  for (std::size_t k = 0; k < merged.size(); ++k) {
    // By slot, so that what is read lies together.
    std::vector<int> slots;
    for (const int vertex : merged[k].below) slots.push_back(tree.slot_of[vertex]);
    std::sort(slots.begin(), slots.end());
    int* to = tree.below.data() + tree.nodes[k].first_below;
    std::fill(to, to + inverse_tile * tree.nodes[k].below_tiles, tree.nothing());
    std::copy(slots.begin(), slots.end(), to);
    for (std::size_t row = 0; row < slots.size(); ++row)
      gathered[slots[row]].push_back(tree.nodes[k].first_below + static_cast<int>(row));
  }
  tree.gather_starts.assign(1, 0);
  for (const std::vector<int>& of_slot : gathered) {
    tree.gathered.insert(tree.gathered.end(), of_slot.begin(), of_slot.end());
    tree.gather_starts.push_back(static_cast<int>(tree.gathered.size()));
  }
  for (std::size_t node = 0; node < merged.size(); ++node) {
    if (node == 0 || merged[node].height != merged[node - 1].height)
      tree.levels.push_back({static_cast<int>(node), 0});
    ++tree.levels.back().node_count;
  }
  return tree;
}

}  // namespace flash::sim::cuda
