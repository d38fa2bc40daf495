#include "sim/plan/decaying_solution.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

namespace flash::sim {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Triplets = std::vector<Eigen::Triplet<double>>;

// Above a hundred columns a cluster, the factor of their rows costs less than their solutions.
constexpr std::ptrdiff_t most_columns = 256;
constexpr double share_of_limit = 1e-3;

// Many right-hand sides at once: a row is contiguous, so the loops run over vectors.
constexpr int block_columns = 32;
using Block = Eigen::Matrix<double, Eigen::Dynamic, block_columns, Eigen::RowMajor>;

void solve(const Eigen::SimplicialLDLT<Sparse>& factor, Block& x) {
  const Sparse& L = factor.matrixL().nestedExpression();
  Block y = factor.permutationP() * x;
  for (int j = 0; j < L.cols(); ++j)
    for (Sparse::InnerIterator it(L, j); it; ++it)
      if (it.row() > j) y.row(it.row()).noalias() -= it.value() * y.row(j);
  y.array().colwise() /= factor.vectorD().array();
  for (int j = int(L.cols()) - 1; j >= 0; --j)
    for (Sparse::InnerIterator it(L, j); it; ++it)
      if (it.row() > j) y.row(j).noalias() -= it.value() * y.row(it.row());
  x = factor.permutationP().transpose() * y;
}

/// Halves the columns across the longer side of their places until each cluster is small enough.
void add_clusters(const Eigen::Matrix2Xd& places, std::span<int> columns,
                  std::vector<std::span<int>>& clusters) {
  if (std::ssize(columns) <= most_columns) {
    clusters.push_back(columns);
    return;
  }
  Eigen::Vector2d low = places.col(columns.front()), high = low;
  for (const int c : columns) {
    low = low.cwiseMin(places.col(c));
    high = high.cwiseMax(places.col(c));
  }
  const int axis = high.x() - low.x() >= high.y() - low.y() ? 0 : 1;
  const std::size_t half = columns.size() / 2;
  std::nth_element(columns.begin(), columns.begin() + std::ptrdiff_t(half), columns.end(), [&](int a, int b) {
    return std::pair(places(axis, a), a) < std::pair(places(axis, b), b);
  });
  add_clusters(places, columns.first(half), clusters);
  add_clusters(places, columns.subspan(half), clusters);
}

/// Some rows and columns of A, and how its other rows depend on them.
struct Patch {
  std::vector<int> rows;  ///< of A
  Sparse matrix;          ///< by places among the rows, as the columns of `beyond`
  Triplets beyond;        ///< entries of the rows of A that are not in the patch, row by row
};

/// Rows where B has entries in the columns, and those within `rings` steps from them. `place_of` is -1 for
/// each row of A, and is returned with the place among the rows of each that is in the patch.
Patch patch_about(std::span<const int> columns, int rings, const Sparse& A, const Sparse& B,
                  std::vector<int>& place_of) {
  Patch patch;
  std::vector<int>& rows = patch.rows;
  const auto add = [&](Eigen::Index row) {
    if (place_of[row] >= 0) return;
    place_of[row] = int(rows.size());
    rows.push_back(int(row));
  };
  for (const int c : columns)
    for (Sparse::InnerIterator it(B, c); it; ++it) add(it.row());
  std::size_t next = 0;
  for (int ring = 0; ring < rings && next < rows.size(); ++ring)
    for (const std::size_t end = rows.size(); next < end; ++next)
      for (Sparse::InnerIterator it(A, rows[next]); it; ++it) add(it.row());

  Triplets within;
  for (int i = 0; i < int(rows.size()); ++i)
    for (Sparse::InnerIterator it(A, rows[i]); it; ++it)
      if (const int place = place_of[it.row()]; place >= 0)
        within.emplace_back(place, i, it.value());
      else
        patch.beyond.emplace_back(int(it.row()), i, it.value());
  patch.matrix.resize(Eigen::Index(rows.size()), Eigen::Index(rows.size()));
  patch.matrix.setFromTriplets(within.begin(), within.end());
  std::stable_sort(patch.beyond.begin(), patch.beyond.end(),
                   [](const auto& a, const auto& b) { return a.row() < b.row(); });
  return patch;
}

/// How far a solution on the patch would move the rows about it, if they were free: the most, by what they
/// may move.
double moves_about(const Patch& patch, const Block& x, const Sparse& A, const Eigen::VectorXd& limits) {
  double most = 0;
  for (auto entry = patch.beyond.begin(); entry != patch.beyond.end();) {
    const int row = entry->row();
    Eigen::Matrix<double, 1, block_columns> residual = Eigen::Matrix<double, 1, block_columns>::Zero();
    for (; entry != patch.beyond.end() && entry->row() == row; ++entry)
      residual += entry->value() * x.row(entry->col());
    const double move = residual.cwiseAbs().maxCoeff() / (share_of_limit * limits[row] * A.coeff(row, row));
    most = std::max(most, std::isnan(move) ? INFINITY : move);
  }
  return most;
}

/// Adds the entries of the solution in these columns, and returns the most of moves_about. Above one, where
/// the patch is too small, some of them are missing.
double add_entries(const Patch& patch, std::span<const int> columns, const Sparse& A, const Sparse& B,
                   const Eigen::VectorXd& limits, const std::vector<int>& place_of, Triplets& entries) {
  const Eigen::SimplicialLDLT<Sparse> factor(patch.matrix);
  Block block(patch.matrix.rows(), block_columns);
  double most = 0;
  for (std::size_t first = 0; first < columns.size(); first += block_columns) {
    const int count = std::min(block_columns, int(columns.size() - first));
    block.setZero();
    for (int j = 0; j < count; ++j)
      for (Sparse::InnerIterator it(B, columns[first + j]); it; ++it)
        block(place_of[it.row()], j) = it.value();
    solve(factor, block);
    most = std::max(most, moves_about(patch, block, A, limits));
    if (!(most <= 1)) return most;
    for (int j = 0; j < count; ++j)
      for (Sparse::InnerIterator it(B, columns[first + j]); it; ++it)
        if (const double value = block(place_of[it.row()], j); !(std::abs(value) >= limits[it.row()]))
          entries.emplace_back(int(it.row()), columns[first + j], value);
    for (std::size_t i = 0; i < patch.rows.size(); ++i)
      for (int j = 0; j < count; ++j)
        if (const double value = block(Eigen::Index(i), j); std::abs(value) >= limits[patch.rows[i]])
          entries.emplace_back(patch.rows[i], columns[first + j], value);
  }
  return most;
}

}  // namespace

Eigen::SparseMatrix<double, Eigen::RowMajor> decaying_solution(const Sparse& A, const Sparse& B,
                                                               const Eigen::VectorXd& limits,
                                                               const Eigen::Matrix2Xd& places) {
  std::vector<int> columns(B.cols());
  std::iota(columns.begin(), columns.end(), 0);
  std::vector<std::span<int>> clusters;
  add_clusters(places, columns, clusters);
  // Limits of zero take all rows that are joined. What one cluster needs the next needs too, about.
  const int least_rings = (limits.array() > 0).all() ? 8 : int(A.rows());
  constexpr double far_less = 1e-2;
  int rings = least_rings;
  Triplets entries;
  std::vector<int> place_of(A.rows(), -1);
  for (const std::span<int> cluster : clusters)
    for (bool done = false; !done;) {
      const Patch patch = patch_about(cluster, rings, A, B, place_of);
      const std::size_t before = entries.size();
      const double moves = add_entries(patch, cluster, A, B, limits, place_of, entries);
      done = moves <= 1;
      for (const int row : patch.rows) place_of[row] = -1;
      if (!done) {
        entries.resize(before);
        rings += rings / 4;
      } else if (moves < far_less) {
        rings = std::max(least_rings, rings - rings / 5);
      }
    }
  Eigen::SparseMatrix<double, Eigen::RowMajor> solution(B.rows(), B.cols());
  solution.setFromTriplets(entries.begin(), entries.end());
  return solution;
}

}  // namespace flash::sim
