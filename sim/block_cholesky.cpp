#include "sim/block_cholesky.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>

#include "sim/dense_front.h"

namespace flash::sim {

namespace {

/// Columns eliminated together; `rows` are the vertices below them that they touch (permuted numbering,
/// sorted).
struct Supernode {
  int first_column = 0, column_count = 0;
  std::vector<int> rows;
  int parent = -1;
  std::vector<int> rows_in_parent;  ///< position of each of `rows` in the parent's front
  std::vector<int> children;
  long zeros = 0;  ///< blocks stored that are zero
};

struct Placement {
  int front_row, front_column;  ///< block position in the supernode's front
  bool transpose;
  int block;
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

/// Storage of a supernode's update matrix.
template <typename Scalar>
long update_entries(const Supernode& node) {
  const int rows = 3 * static_cast<int>(node.rows.size());
  return static_cast<long>(padded<Scalar>(rows)) * rows;
}

/// Zeros that merging `child` into its parent would store, in blocks.
long merge_zeros(const Supernode& child, const Supernode& parent) {
  return static_cast<long>(child.column_count) * (front_size(parent) - static_cast<long>(child.rows.size()));
}

}  // namespace

struct SymbolicFactor {
  int size = 0;
  std::vector<int> position;                       ///< vertex -> elimination position
  std::vector<Supernode> supernodes;               ///< in elimination order
  std::vector<std::vector<Placement>> placements;  ///< matrix blocks that enter each front
  long entries = 0;
  int largest_front = 0;
};

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
  std::vector<std::vector<int>> structure(size);  // rows below the diagonal, column by column
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

  // Fundamental supernodes, then merged with the parent where few zeros are stored: larger dense fronts run
  // faster.
  std::vector<Supernode> nodes;
  for (int column = 0; column < size; ++column) {
    const bool extends = !nodes.empty() && parent[column - 1] == column &&
                         structure[column - 1].size() == structure[column].size() + 1;
    if (extends) {
      ++nodes.back().column_count;
      nodes.back().rows = structure[column];
    } else {
      nodes.push_back({column, 1, structure[column], -1, {}, {}, 0});
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

  auto symbolic = std::make_shared<SymbolicFactor>();
  symbolic->size = size;
  symbolic->position = position;
  std::vector<int> owner(size);
  for (int s = 0; s < static_cast<int>(nodes.size()); ++s)
    for (int c = 0; c < nodes[s].column_count; ++c) owner[nodes[s].first_column + c] = s;
  const auto front_position = [&](const Supernode& node, int row) {
    if (row < node.first_column + node.column_count) return row - node.first_column;
    return node.column_count +
           static_cast<int>(std::lower_bound(node.rows.begin(), node.rows.end(), row) - node.rows.begin());
  };
  for (int s = 0; s < static_cast<int>(nodes.size()); ++s) {
    Supernode& node = nodes[s];
    symbolic->entries += 9L * node.column_count * front_size(node);
    symbolic->largest_front = std::max(symbolic->largest_front, front_size(node));
    if (node.rows.empty()) continue;
    node.parent = owner[node.rows.front()];
    nodes[node.parent].children.push_back(s);
    for (int row : node.rows) node.rows_in_parent.push_back(front_position(nodes[node.parent], row));
  }
  symbolic->placements.resize(nodes.size());
  for (int vertex = 0; vertex < size; ++vertex) {
    const int s = owner[position[vertex]];
    const int local = position[vertex] - nodes[s].first_column;
    symbolic->placements[s].push_back({local, local, false, vertex});
  }
  for (int k = 0; k < static_cast<int>(pattern.pairs.size()); ++k) {
    const int row = position[pattern.pairs[k].first], column = position[pattern.pairs[k].second];
    const bool transpose = row < column;
    const int s = owner[std::min(row, column)];
    symbolic->placements[s].push_back({front_position(nodes[s], std::max(row, column)),
                                       std::min(row, column) - nodes[s].first_column, transpose, size + k});
  }
  symbolic->supernodes = std::move(nodes);
  return symbolic;
}

const std::vector<int>& elimination_position(const SymbolicFactor& symbolic) { return symbolic.position; }

long factor_entries(const SymbolicFactor& symbolic) { return symbolic.entries; }

template <typename Scalar>
BlockCholesky<Scalar>::BlockCholesky(std::shared_ptr<const SymbolicFactor> symbolic)
    : symbolic_(std::move(symbolic)) {
  long entries = 0, stack = 0, largest_stack = 0;
  for (const Supernode& node : symbolic_->supernodes) {
    offsets_.push_back(entries);
    entries += static_cast<long>(padded<Scalar>(3 * front_size(node))) * 3 * node.column_count;
    long children = 0;
    for (int child : node.children) children += update_entries<Scalar>(symbolic_->supernodes[child]);
    // The update is built above the children's, then moves down onto them.
    largest_stack = std::max(largest_stack, stack + update_entries<Scalar>(node));
    stack += update_entries<Scalar>(node) - children;
  }
  factor_.resize(entries + 2 * lanes<Scalar>);
  stack_.resize(largest_stack);
  update_offsets_.resize(symbolic_->supernodes.size());
  front_.resize(3 * symbolic_->largest_front + 2 * lanes<Scalar>);
  permuted_.resize(3 * symbolic_->size);
  inverses_.resize(6 * symbolic_->size);
}

template <typename Scalar>
bool BlockCholesky<Scalar>::factorize(const BlockValues<double>& values) {
  const auto& nodes = symbolic_->supernodes;
  long top = 0;
  for (size_t s = 0; s < nodes.size(); ++s) {
    const Supernode& node = nodes[s];
    const int columns = 3 * node.column_count, rows = 3 * static_cast<int>(node.rows.size());
    const int front_rows = padded<Scalar>(columns + rows), update_rows = padded<Scalar>(rows);
    Scalar* factor = factor_.data() + offsets_[s];
    std::fill(factor, factor + static_cast<long>(front_rows) * columns, Scalar(0));
    for (const Placement& place : symbolic_->placements[s]) {
      const double* block = values.data() + 9L * place.block;
      Scalar* target = factor + 3L * place.front_column * front_rows + 3L * place.front_row;
      for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
          target[c * front_rows + r] =
              static_cast<Scalar>(place.transpose ? block[3 * r + c] : block[3 * c + r]);
    }
    Scalar* update = stack_.data() + top;
    std::fill(update, update + update_entries<Scalar>(node), Scalar(0));
    for (int child : node.children) {
      const auto& map = nodes[child].rows_in_parent;
      const int child_rows = padded<Scalar>(3 * static_cast<int>(map.size()));
      const Scalar* child_update = stack_.data() + update_offsets_[child];
      for (size_t column = 0; column < map.size(); ++column) {
        const int target_column = 3 * map[column];
        for (int c = 0; c < 3; ++c) {
          const Scalar* source = child_update + (3L * column + c) * child_rows;
          Scalar* target =
              target_column < columns
                  ? factor + static_cast<long>(target_column + c) * front_rows
                  : update + static_cast<long>(target_column - columns + c) * update_rows - columns;
          for (size_t row = column; row < map.size(); ++row) {
            Scalar* entry = target + 3 * map[row];
            entry[0] += source[3 * row];
            entry[1] += source[3 * row + 1];
            entry[2] += source[3 * row + 2];
          }
        }
      }
    }
    if (!eliminate_columns(factor, front_rows, columns)) return false;
    if (rows > 0) subtract_outer_product(update, update_rows, rows, factor, front_rows, columns);
    extract_diagonal(factor, front_rows, columns, inverses_.data() + 6L * node.first_column);
    if (!node.children.empty()) {
      const long base = update_offsets_[node.children.front()];
      std::copy(update, update + update_entries<Scalar>(node), stack_.data() + base);
      top = base;
    }
    update_offsets_[s] = top;
    top += update_entries<Scalar>(node);
  }
  return true;
}

namespace {

// Few numbers: a call of memmove would cost more than the copy.

template <typename Scalar>
void copy_vertex(const Scalar* from, Scalar* to) {
  to[0] = from[0];
  to[1] = from[1];
  to[2] = from[2];
}

template <typename Scalar>
void copy_vertices(const Scalar* from, int count, Scalar* to) {
  for (int i = 0; i < count; ++i) copy_vertex(from + 3L * i, to + 3L * i);
}

}  // namespace

template <typename Scalar>
void BlockCholesky<Scalar>::solve_in_order(Scalar* x) const {
  const auto& nodes = symbolic_->supernodes;
  const auto gather = [&](const Supernode& node) {
    const int columns = 3 * node.column_count, rows = 3 * static_cast<int>(node.rows.size());
    copy_vertices(x + 3L * node.first_column, node.column_count, front_.data());
    for (size_t r = 0; r < node.rows.size(); ++r)
      copy_vertex(x + 3L * node.rows[r], front_.data() + columns + 3 * r);
    std::fill(front_.begin() + columns + rows, front_.begin() + padded<Scalar>(columns + rows), Scalar(0));
  };
  for (size_t s = 0; s < nodes.size(); ++s) {
    const Supernode& node = nodes[s];
    const int columns = 3 * node.column_count, rows = 3 * static_cast<int>(node.rows.size());
    gather(node);
    solve_forward(factor_.data() + offsets_[s], padded<Scalar>(columns + rows), columns,
                  inverses_.data() + 6L * node.first_column, front_.data());
    copy_vertices(front_.data(), node.column_count, x + 3L * node.first_column);
    for (size_t r = 0; r < node.rows.size(); ++r)
      copy_vertex(front_.data() + columns + 3 * r, x + 3L * node.rows[r]);
  }
  for (size_t s = nodes.size(); s-- > 0;) {
    const Supernode& node = nodes[s];
    const int columns = 3 * node.column_count, rows = 3 * static_cast<int>(node.rows.size());
    gather(node);
    solve_backward(factor_.data() + offsets_[s], padded<Scalar>(columns + rows), columns,
                   inverses_.data() + 6L * node.first_column, front_.data());
    copy_vertices(front_.data(), node.column_count, x + 3L * node.first_column);
  }
}

template <typename Scalar>
void BlockCholesky<Scalar>::solve_in_place(double* x) const {
  for (int vertex = 0; vertex < symbolic_->size; ++vertex)
    for (int c = 0; c < 3; ++c)
      permuted_[3 * symbolic_->position[vertex] + c] = static_cast<Scalar>(x[3 * vertex + c]);
  solve_in_order(permuted_.data());
  for (int vertex = 0; vertex < symbolic_->size; ++vertex)
    for (int c = 0; c < 3; ++c) x[3 * vertex + c] = permuted_[3 * symbolic_->position[vertex] + c];
}

template class BlockCholesky<double>;
template class BlockCholesky<float>;

}  // namespace flash::sim
