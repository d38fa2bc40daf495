#include "sim/cpu/symbolic_factor.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>

namespace flash::sim {

namespace {

/// Columns eliminated together; `rows` are the vertices below them that they touch (permuted numbering,
/// sorted).
struct Supernode {
  std::vector<int> columns, rows;
  long zeros = 0;  ///< blocks stored that are zero
};

long front_size(const Supernode& node) { return static_cast<long>(node.columns.size() + node.rows.size()); }

/// Approximate minimum degree (Amestoy, Davis, Duff 1996) on the vertex graph: vertices by elimination.
std::vector<int> minimum_degree(const BlockPattern& pattern) {
  std::vector<Eigen::Triplet<double>> entries;
  for (const auto& [row, column] : pattern.pairs)
    entries.emplace_back(std::max(row, column), std::min(row, column), 1.0);
  for (int i = 0; i < pattern.size; ++i) entries.emplace_back(i, i, 1.0);
  Eigen::SparseMatrix<double> graph(pattern.size, pattern.size);
  graph.setFromTriplets(entries.begin(), entries.end());
  Eigen::AMDOrdering<int>::PermutationType order;
  Eigen::AMDOrdering<int>()(graph.selfadjointView<Eigen::Lower>(), order);
  return {order.indices().begin(), order.indices().end()};
}

/// Elimination tree of the pattern under `position` (Liu 1990, with path compression).
std::vector<int> elimination_tree(int size, const std::vector<std::vector<int>>& earlier_neighbours) {
  std::vector<int> parent(size, -1), ancestor(size, -1);
  for (int column = 0; column < size; ++column) {
    for (int neighbour : earlier_neighbours[column]) {
      for (int node = neighbour; node != -1 && node < column;) {
        const int next = ancestor[node];
        ancestor[node] = column;
        if (next == -1) parent[node] = column;
        node = next;
      }
    }
  }
  return parent;
}

std::vector<int> postorder(const std::vector<int>& parent) {
  const int size = static_cast<int>(parent.size());
  std::vector<std::vector<int>> children(size);
  std::vector<int> order, stack;
  for (int node = size - 1; node >= 0; --node) {
    if (parent[node] < 0)
      stack.push_back(node);
    else
      children[parent[node]].push_back(node);
  }
  std::vector<char> opened(size, 0);
  while (!stack.empty()) {
    const int node = stack.back();
    if (opened[node]) {
      order.push_back(node);
      stack.pop_back();
    } else {
      opened[node] = 1;
      stack.insert(stack.end(), children[node].begin(), children[node].end());
    }
  }
  return order;
}

std::vector<std::vector<int>> earlier_neighbours(const BlockPattern& pattern,
                                                 const std::vector<int>& position) {
  std::vector<std::vector<int>> lists(pattern.size);
  for (const auto& [row, column] : pattern.pairs) {
    const auto [low, high] = std::minmax(position[row], position[column]);
    lists[high].push_back(low);
  }
  return lists;
}

/// Rows below the diagonal of L, column by column.
std::vector<std::vector<int>> column_structure(const std::vector<int>& parent,
                                               const std::vector<std::vector<int>>& earlier) {
  const int size = static_cast<int>(parent.size());
  std::vector<std::vector<int>> structure(size);
  for (int row = 0; row < size; ++row)
    for (int column : earlier[row]) structure[column].push_back(row);
  std::vector<std::vector<int>> children(size);
  for (int column = 0; column < size; ++column) {
    auto& rows = structure[column];
    for (int child : children[column])
      for (int row : structure[child])
        if (row != column) rows.push_back(row);
    std::sort(rows.begin(), rows.end());
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    if (parent[column] >= 0) children[parent[column]].push_back(column);
  }
  return structure;
}

/// Columns with the same rows below them.
std::vector<Supernode> fundamental_supernodes(const std::vector<int>& parent,
                                              const std::vector<std::vector<int>>& structure) {
  std::vector<Supernode> nodes;
  for (int column = 0; column < static_cast<int>(parent.size()); ++column) {
    const bool extends = !nodes.empty() && parent[column - 1] == column &&
                         structure[column - 1].size() == structure[column].size() + 1;
    if (!extends) nodes.emplace_back();
    nodes.back().columns.push_back(column);
    nodes.back().rows = structure[column];
  }
  return nodes;
}

/// Zeros that merging `child` into its parent would store, with those stored already, in blocks.
long zeros_of_both(const Supernode& child, const Supernode& parent) {
  return child.zeros + parent.zeros +
         static_cast<long>(child.columns.size()) *
             (front_size(parent) - static_cast<long>(child.rows.size()));
}

/// Merges supernodes with their parents where few zeros are stored, more where both are small (Ashcraft and
/// Grimes 1989): larger dense fronts run faster. The result is in postorder, columns ascending in each.
std::vector<Supernode> amalgamated(std::vector<Supernode> nodes) {
  constexpr std::size_t small = 8;  ///< columns
  constexpr double zeros_of_small = 0.3, zeros_of_large = 0.06;
  std::vector<int> owner, parent(nodes.size(), -1);
  for (std::size_t s = 0; s < nodes.size(); ++s)
    owner.resize(owner.size() + nodes[s].columns.size(), static_cast<int>(s));
  std::vector<std::vector<int>> children(nodes.size());
  for (std::size_t s = 0; s < nodes.size(); ++s) {
    if (nodes[s].rows.empty()) continue;
    parent[s] = owner[nodes[s].rows.front()];
    children[parent[s]].push_back(static_cast<int>(s));
  }
  std::vector<char> merged(nodes.size(), 0);
  for (std::size_t s = 0; s < nodes.size(); ++s) {
    Supernode& node = nodes[s];
    std::vector<int>& candidates = children[s];
    const auto share_of_zeros = [&](int child) {
      const std::size_t columns = node.columns.size() + nodes[child].columns.size();
      const double share = static_cast<double>(zeros_of_both(nodes[child], node)) /
                           static_cast<double>(columns * (columns + node.rows.size()));
      return share <= (columns <= small ? zeros_of_small : zeros_of_large) ? share : 1.0;
    };
    while (!candidates.empty()) {
      const auto best = std::ranges::min_element(candidates, {}, share_of_zeros);
      const int child = *best;
      if (share_of_zeros(child) == 1.0) break;
      candidates.erase(best);
      node.zeros = zeros_of_both(nodes[child], node);
      node.columns.insert(node.columns.end(), nodes[child].columns.begin(), nodes[child].columns.end());
      candidates.insert(candidates.end(), children[child].begin(), children[child].end());
      for (const int grandchild : children[child]) parent[grandchild] = static_cast<int>(s);
      merged[child] = 1;
    }
    std::ranges::sort(node.columns);
  }
  std::vector<Supernode> result;
  for (const int s : postorder(parent))
    if (!merged[s]) result.push_back(std::move(nodes[s]));
  return result;
}

int padded(int rows) { return (rows + front_padding - 1) / front_padding * front_padding; }

/// The supernodes as fronts, with what enters them.
void add_fronts(const BlockPattern& pattern, const std::vector<Supernode>& nodes, SymbolicFactor& symbolic) {
  std::vector<int> owner(pattern.size);
  const std::vector<int>& position = symbolic.position;
  for (std::size_t s = 0; s < nodes.size(); ++s)
    for (const int column : nodes[s].columns) owner[column] = static_cast<int>(s);
  const auto row_in = [&](const Supernode& node, int row) {
    const int columns = static_cast<int>(node.columns.size());
    if (row <= node.columns.back()) return row - node.columns.front();
    return columns +
           static_cast<int>(std::lower_bound(node.rows.begin(), node.rows.end(), row) - node.rows.begin());
  };
  std::vector<std::vector<int>> node_children(nodes.size());
  std::vector<std::vector<FrontBlock>> node_blocks(nodes.size());
  for (std::size_t s = 0; s < nodes.size(); ++s)
    if (!nodes[s].rows.empty()) node_children[owner[nodes[s].rows.front()]].push_back(static_cast<int>(s));
  for (int vertex = 0; vertex < pattern.size; ++vertex) {
    const int s = owner[position[vertex]], place = position[vertex] - nodes[s].columns.front();
    node_blocks[s].push_back({place, place, false, vertex});
  }
  for (std::size_t k = 0; k < pattern.pairs.size(); ++k) {
    const int row = position[pattern.pairs[k].first], column = position[pattern.pairs[k].second];
    const int s = owner[std::min(row, column)];
    node_blocks[s].push_back({row_in(nodes[s], std::max(row, column)),
                              std::min(row, column) - nodes[s].columns.front(), row < column,
                              pattern.size + static_cast<int>(k)});
  }
  for (std::size_t s = 0; s < nodes.size(); ++s) {
    const Supernode& node = nodes[s];
    Front front{};
    front.first_column = node.columns.front();
    front.column_count = static_cast<int>(node.columns.size());
    front.first_row = static_cast<int>(symbolic.rows.size());
    front.row_count = static_cast<int>(node.rows.size());
    front.first_child = static_cast<int>(symbolic.children.size());
    front.child_count = static_cast<int>(node_children[s].size());
    front.first_block = static_cast<int>(symbolic.blocks.size());
    front.block_count = static_cast<int>(node_blocks[s].size());
    symbolic.fronts.push_back(front);
    for (const int row : node.rows) {
      symbolic.rows.push_back(row);
      symbolic.rows_in_parent.push_back(row_in(nodes[owner[node.rows.front()]], row));
    }
    symbolic.children.insert(symbolic.children.end(), node_children[s].begin(), node_children[s].end());
    symbolic.blocks.insert(symbolic.blocks.end(), node_blocks[s].begin(), node_blocks[s].end());
  }
}

/// Places of the fronts' numbers: columns one after the other, update matrices on a stack. An update matrix
/// is made above those of the children, then moves down onto them.
void place_fronts(SymbolicFactor& symbolic) {
  long top = 0;
  for (Front& front : symbolic.fronts) {
    const int columns = 3 * front.column_count, rows = 3 * front.row_count;
    front.padded_rows = padded(columns + rows);
    front.padded_update_rows = padded(rows);
    symbolic.largest_front = std::max(symbolic.largest_front, front.padded_rows);
    symbolic.entries += static_cast<long>(columns) * (columns + rows);
    front.columns_at = symbolic.factor_size;
    const long size = static_cast<long>(front.padded_rows) * columns;
    symbolic.largest_columns = std::max(symbolic.largest_columns, size);
    symbolic.factor_size += size;
    const long update_size = static_cast<long>(front.padded_update_rows) * rows;
    front.built_at = front.update_at = top;
    if (front.child_count > 0)
      front.update_at = symbolic.fronts[symbolic.children[front.first_child]].update_at;
    symbolic.stack_size = std::max(symbolic.stack_size, front.built_at + update_size);
    top = front.update_at + update_size;
  }
}

}  // namespace

std::shared_ptr<const SymbolicFactor> analyze(const BlockPattern& pattern) {
  const int size = pattern.size;
  std::vector<int> order = minimum_degree(pattern);
  std::vector<int> position(size);
  for (int i = 0; i < size; ++i) position[order[i]] = i;
  const std::vector<int> post = postorder(elimination_tree(size, earlier_neighbours(pattern, position)));
  std::vector<int> renumber(size);
  for (int i = 0; i < size; ++i) renumber[post[i]] = i;
  for (int& p : position) p = renumber[p];

  const auto earlier = earlier_neighbours(pattern, position);
  const std::vector<int> parent = elimination_tree(size, earlier);
  std::vector<Supernode> nodes =
      amalgamated(fundamental_supernodes(parent, column_structure(parent, earlier)));
  // Numbers in the order of elimination, which merging has changed.
  int next = 0;
  for (const Supernode& node : nodes)
    for (const int column : node.columns) renumber[column] = next++;
  for (int& p : position) p = renumber[p];
  for (Supernode& node : nodes) {
    for (int& column : node.columns) column = renumber[column];
    for (int& row : node.rows) row = renumber[row];
    std::sort(node.rows.begin(), node.rows.end());
  }
  auto symbolic = std::make_shared<SymbolicFactor>();
  symbolic->position = position;
  add_fronts(pattern, nodes, *symbolic);
  place_fronts(*symbolic);
  return symbolic;
}

}  // namespace flash::sim
