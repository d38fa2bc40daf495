#include "sim/cuda/layout/inverse_factor.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>
#include <stdexcept>

namespace flash::sim::cuda {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

std::uint16_t bits_of(float number) { return Eigen::half(number).x; }

float number_of(std::uint16_t bits) { return static_cast<float>(Eigen::numext::bit_cast<Eigen::half>(bits)); }

/// Writes a matrix as tiles, row of tiles after row of tiles.
void write_tiles(const MatrixXd& matrix, int column_tiles, int parts, std::uint16_t* tiles) {
  for (Index row = 0; row < matrix.rows(); ++row)
    for (Index column = 0; column < matrix.cols(); ++column) {
      const Index tile = row / inverse_tile * column_tiles + column / inverse_tile;
      std::uint16_t* to = tiles + tile * parts * inverse_tile_numbers +
                          place_in_inverse_tile(static_cast<int>(row % inverse_tile),
                                                static_cast<int>(column % inverse_tile));
      const auto number = static_cast<float>(matrix(row, column));
      *to = bits_of(number);
      if (parts == 2) to[inverse_tile_numbers] = bits_of(low_scale * (number - number_of(*to)));
    }
}

}  // namespace

InverseFactor factorize_inverse(const InverseTree& tree, const Eigen::SparseMatrix<double>& A,
                                const std::vector<char>& held, InversePrecision precision) {
  const int parts = parts_of(precision);
  InverseFactor factor;
  factor.tiles.assign(static_cast<std::size_t>(tree.tiles) * parts * inverse_tile_numbers, 0);
  factor.scale.assign(tree.slots, 0);
  Eigen::VectorXd scale = Eigen::VectorXd::Zero(tree.size);
  for (int i = 0; i < tree.size; ++i)
    if (held[i] == 0) {
      if (!(A.coeff(i, i) > 0)) throw std::domain_error("the matrix is not positive definite");
      scale[i] = 1 / std::sqrt(A.coeff(i, i));
      factor.scale[tree.slot_of[i]] = static_cast<float>(scale[i]);
    }
  std::vector<MatrixXd> updates(tree.nodes.size());
  std::vector<std::vector<int>> children(tree.nodes.size());
  for (std::size_t k = 0; k < tree.nodes.size(); ++k)
    if (tree.parents[k] >= 0) children[tree.parents[k]].push_back(static_cast<int>(k));
  std::vector<int> row_of(tree.slots + 1, -1);  // of a slot in the front
  for (std::size_t k = 0; k < tree.nodes.size(); ++k) {
    const InverseNode& node = tree.nodes[k];
    const int columns = inverse_tile * node.column_tiles, below = inverse_tile * node.below_tiles;
    const int first = inverse_tile * node.first_block;
    for (int c = 0; c < columns; ++c) row_of[first + c] = c;
    for (int r = 0; r < below; ++r) row_of[tree.below[node.first_below + r]] = columns + r;
    row_of[tree.nothing()] = -1;
    MatrixXd front = MatrixXd::Zero(columns + below, columns + below);
    for (int c = 0; c < columns; ++c) {
      const int vertex = tree.vertex_at[first + c];
      if (vertex < 0 || held[vertex] != 0) {
        front(c, c) = 1;
        continue;
      }
      for (Eigen::SparseMatrix<double>::InnerIterator entry(A, vertex); entry; ++entry) {
        const int row = row_of[tree.slot_of[entry.row()]];
        if (row >= 0) front(row, c) += scale[entry.row()] * scale[vertex] * entry.value();
      }
    }
    for (const int child : children[k]) {
      const MatrixXd& update = updates[child];
      std::vector<int> rows;
      for (Index r = 0; r < update.rows(); ++r)
        rows.push_back(row_of[tree.below[tree.nodes[child].first_below + r]]);
      for (Index c = 0; c < update.cols(); ++c)
        for (Index r = 0; r < update.rows() && rows[c] >= 0; ++r)
          if (rows[r] >= 0) front(rows[r], rows[c]) += update(r, c);
      updates[child].resize(0, 0);
    }
    const Eigen::LLT<MatrixXd> llt(front.topLeftCorner(columns, columns));
    if (llt.info() != Eigen::Success) throw std::domain_error("the matrix is not positive definite");
    MatrixXd inverse = llt.solve(MatrixXd::Identity(columns, columns));
    const MatrixXd coupling = front.bottomLeftCorner(below, columns), W = -coupling * inverse;
    updates[k] = front.bottomRightCorner(below, below) + W * coupling.transpose();
    for (int c = 0; c < columns; ++c) {
      const int vertex = tree.vertex_at[first + c];
      if (vertex < 0 || held[vertex] != 0) inverse(c, c) = 0;
    }
    const auto tiles_from = [&](int tile) {
      return factor.tiles.data() + static_cast<std::size_t>(tile) * parts * inverse_tile_numbers;
    };
    write_tiles(inverse, node.column_tiles, parts, tiles_from(node.first_D));
    write_tiles(W, node.column_tiles, parts, tiles_from(node.first_W));
    for (int c = 0; c < columns; ++c) row_of[first + c] = -1;
    for (int r = 0; r < below; ++r) row_of[tree.below[node.first_below + r]] = -1;
  }
  return factor;
}

data::Points apply_inverse(const InverseTree& tree, const InverseFactor& factor, InversePrecision precision,
                           const data::Points& b) {
  const int parts = parts_of(precision);
  using Vectors = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
  Vectors right = Vectors::Zero(tree.slots + inverse_tile, 3), x = right;
  for (int i = 0; i < tree.size; ++i)
    right.row(tree.slot_of[i]) = factor.scale[tree.slot_of[i]] * b.row(i).cast<float>();
  Vectors passed = Vectors::Zero(static_cast<Index>(tree.below.size()), 3);
  const auto number = [&](int tile, int row, int column) {
    const std::uint16_t* at = factor.tiles.data() +
                              static_cast<std::size_t>(tile) * parts * inverse_tile_numbers +
                              place_in_inverse_tile(row, column);
    return number_of(*at) + (parts == 2 ? number_of(at[inverse_tile_numbers]) / low_scale : 0.0f);
  };
  for (const InverseLevel& level : tree.levels) {
    for (int k = level.first_node; k < level.first_node + level.node_count; ++k) {
      const InverseNode& node = tree.nodes[k];
      for (int slot = inverse_tile * node.first_block;
           slot < inverse_tile * (node.first_block + node.column_tiles); ++slot)
        for (int g = tree.gather_starts[slot]; g < tree.gather_starts[slot + 1]; ++g)
          right.row(slot) += passed.row(tree.gathered[g]);
    }
    for (int k = level.first_node; k < level.first_node + level.node_count; ++k) {
      const InverseNode& node = tree.nodes[k];
      for (int row = 0; row < inverse_tile * node.below_tiles; ++row)
        for (int c = 0; c < inverse_tile * node.column_tiles; ++c)
          passed.row(node.first_below + row) +=
              number(node.first_W + row / inverse_tile * node.column_tiles + c / inverse_tile,
                     row % inverse_tile, c % inverse_tile) *
              right.row(inverse_tile * node.first_block + c);
    }
  }
  for (std::size_t k = tree.nodes.size(); k-- > 0;) {
    const InverseNode& node = tree.nodes[k];
    const int columns = inverse_tile * node.column_tiles;
    for (int own = 0; own < columns; ++own) {
      const int tile = own / inverse_tile;
      Eigen::RowVector3f sum = Eigen::RowVector3f::Zero();
      for (int c = 0; c < columns; ++c)
        sum += number(node.first_D + tile * node.column_tiles + c / inverse_tile, own % inverse_tile,
                      c % inverse_tile) *
               right.row(inverse_tile * node.first_block + c);
      for (int row = 0; row < inverse_tile * node.below_tiles; ++row)
        sum += number(node.first_W + row / inverse_tile * node.column_tiles + tile, row % inverse_tile,
                      own % inverse_tile) *
               x.row(tree.below[node.first_below + row]);
      x.row(inverse_tile * node.first_block + own) = sum;
    }
  }
  data::Points result(tree.size, 3);
  for (int i = 0; i < tree.size; ++i)
    result.row(i) = (factor.scale[tree.slot_of[i]] * x.row(tree.slot_of[i])).cast<double>();
  return result;
}

}  // namespace flash::sim::cuda
