#include "sim/cpu/block_cholesky.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>

#include "sim/cpu/kernels.h"

namespace flash::sim {

namespace {

/// Columns eliminated together; `rows` are the vertices below them that they touch (permuted numbering,
/// sorted).
struct Supernode {
  int first_column = 0, column_count = 0;
  std::vector<int> rows;
  long zeros = 0;  ///< blocks stored that are zero
};

int front_size(const Supernode& node) { return node.column_count + static_cast<int>(node.rows.size()); }

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

/// Zeros that merging `child` into its parent would store, in blocks.
long merge_zeros(const Supernode& child, const Supernode& parent) {
  return static_cast<long>(child.column_count) * (front_size(parent) - static_cast<long>(child.rows.size()));
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

/// Fundamental supernodes, then merged with the parent where few zeros are stored: larger dense fronts run
/// faster.
std::vector<Supernode> supernodes(const std::vector<int>& parent,
                                  const std::vector<std::vector<int>>& structure) {
  const int size = static_cast<int>(parent.size());
  std::vector<Supernode> nodes;
  for (int column = 0; column < size; ++column) {
    const bool extends = !nodes.empty() && parent[column - 1] == column &&
                         structure[column - 1].size() == structure[column].size() + 1;
    if (extends) {
      ++nodes.back().column_count;
      nodes.back().rows = structure[column];
    } else {
      nodes.push_back({column, 1, structure[column], 0});
    }
    while (nodes.size() >= 2) {
      Supernode& last = nodes.back();
      Supernode& before = nodes[nodes.size() - 2];
      const int end = last.first_column + last.column_count;
      const bool complete = column + 1 == size || parent[column] != column + 1 ||
                            structure[column].size() != structure[column + 1].size() + 1;
      if (!complete || before.rows.empty() || before.rows.front() < last.first_column ||
          before.rows.front() >= end)
        break;
      const long zeros = before.zeros + last.zeros + merge_zeros(before, last);
      const int columns = before.column_count + last.column_count;
      const long stored = static_cast<long>(columns) * (columns + static_cast<long>(last.rows.size()));
      if (zeros * 16 > stored) break;
      before.column_count = columns;
      before.zeros = zeros;
      before.rows = last.rows;
      nodes.pop_back();
    }
  }
  return nodes;
}

int padded(int rows) { return (rows + front_padding - 1) / front_padding * front_padding; }

}  // namespace

struct SymbolicFactor {
  std::vector<int> position;  ///< vertex -> elimination position
  // As in FrontTree.
  std::vector<Front> fronts;
  std::vector<int> rows, rows_in_parent, children;
  std::vector<FrontBlock> blocks;
  long entries = 0;      ///< of L
  long factor_size = 0;  ///< with the padding
  long stack_size = 0;
  int largest_front = 0;  ///< padded rows

  FrontTree tree() const {
    return {static_cast<int>(fronts.size()), fronts.data(),   rows.data(),
            rows_in_parent.data(),           children.data(), blocks.data()};
  }
};

namespace {

/// The supernodes as fronts, with what enters them.
void add_fronts(const BlockPattern& pattern, const std::vector<Supernode>& nodes, SymbolicFactor& symbolic) {
  std::vector<int> owner(pattern.size);
  const std::vector<int>& position = symbolic.position;
  for (std::size_t s = 0; s < nodes.size(); ++s)
    for (int c = 0; c < nodes[s].column_count; ++c) owner[nodes[s].first_column + c] = static_cast<int>(s);
  const auto row_in = [&](const Supernode& node, int row) {
    if (row < node.first_column + node.column_count) return row - node.first_column;
    return node.column_count +
           static_cast<int>(std::lower_bound(node.rows.begin(), node.rows.end(), row) - node.rows.begin());
  };
  std::vector<std::vector<int>> node_children(nodes.size());
  std::vector<std::vector<FrontBlock>> node_blocks(nodes.size());
  for (std::size_t s = 0; s < nodes.size(); ++s)
    if (!nodes[s].rows.empty()) node_children[owner[nodes[s].rows.front()]].push_back(static_cast<int>(s));
  for (int vertex = 0; vertex < pattern.size; ++vertex) {
    const int s = owner[position[vertex]], place = position[vertex] - nodes[s].first_column;
    node_blocks[s].push_back({place, place, false, vertex});
  }
  for (std::size_t k = 0; k < pattern.pairs.size(); ++k) {
    const int row = position[pattern.pairs[k].first], column = position[pattern.pairs[k].second];
    const int s = owner[std::min(row, column)];
    node_blocks[s].push_back({row_in(nodes[s], std::max(row, column)),
                              std::min(row, column) - nodes[s].first_column, row < column,
                              pattern.size + static_cast<int>(k)});
  }
  for (std::size_t s = 0; s < nodes.size(); ++s) {
    const Supernode& node = nodes[s];
    Front front{};
    front.first_column = node.first_column;
    front.column_count = node.column_count;
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
    symbolic.factor_size += static_cast<long>(front.padded_rows) * columns;
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
  const std::vector<Supernode> nodes = supernodes(parent, column_structure(parent, earlier));
  auto symbolic = std::make_shared<SymbolicFactor>();
  symbolic->position = position;
  add_fronts(pattern, nodes, *symbolic);
  place_fronts(*symbolic);
  return symbolic;
}

const std::vector<int>& elimination_position(const SymbolicFactor& symbolic) { return symbolic.position; }

long factor_entries(const SymbolicFactor& symbolic) { return symbolic.entries; }

template <typename Scalar>
BlockCholesky<Scalar>::BlockCholesky(std::shared_ptr<const SymbolicFactor> symbolic, const Kernels& kernels)
    : symbolic_(std::move(symbolic)), kernels_(&kernels) {
  // Rows below a front's own are read by whole vectors from where they start: past the end of its last
  // column.
  factor_.resize(symbolic_->factor_size + front_padding);
  stack_.resize(symbolic_->stack_size);
  inverses_.resize(6 * symbolic_->position.size());
  front_.resize(symbolic_->largest_front);
  permuted_.resize(3 * symbolic_->position.size());
}

template <typename Scalar>
bool BlockCholesky<Scalar>::factorize(const BlockValues<double>& values) {
  return linear<Scalar>(*kernels_).factorize(symbolic_->tree(), values.data(), factor_.data(), stack_.data(),
                                             inverses_.data());
}

template <typename Scalar>
void BlockCholesky<Scalar>::solve_in_order(Scalar* x) const {
  linear<Scalar>(*kernels_).solve(symbolic_->tree(), factor_.data(), inverses_.data(), front_.data(), x);
}

template <typename Scalar>
void BlockCholesky<Scalar>::solve_in_place(double* x) const {
  const std::vector<int>& position = symbolic_->position;
  for (std::size_t vertex = 0; vertex < position.size(); ++vertex)
    for (int c = 0; c < 3; ++c) permuted_[3 * position[vertex] + c] = static_cast<Scalar>(x[3 * vertex + c]);
  solve_in_order(permuted_.data());
  for (std::size_t vertex = 0; vertex < position.size(); ++vertex)
    for (int c = 0; c < 3; ++c) x[3 * vertex + c] = permuted_[3 * position[vertex] + c];
}

template class BlockCholesky<double>;
template class BlockCholesky<float>;

}  // namespace flash::sim
