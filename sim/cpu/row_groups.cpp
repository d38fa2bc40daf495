#include "sim/cpu/row_groups.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "sim/cpu/kernels.h"

namespace flash::sim {
namespace {

using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;
using Group = std::array<int, 4>;

/// Each row that is left takes the three that it is coupled to most: its neighbours in the mesh.
std::vector<Group> group_rows(const Matrix& matrix) {
  std::vector<Group> groups;
  std::vector<char> taken(matrix.rows(), 0);
  std::vector<double> coupling(matrix.rows(), 0.0);
  std::vector<int> candidates;
  for (int first = 0; first < matrix.rows(); ++first) {
    if (taken[first]) continue;
    Group group = {first, -1, -1, -1};
    candidates.clear();
    for (int member = 0; member < 4 && group[member] >= 0; ++member) {
      taken[group[member]] = 1;
      for (Matrix::InnerIterator entry(matrix, group[member]); entry; ++entry) {
        const int column = static_cast<int>(entry.col());
        if (coupling[column] == 0) candidates.push_back(column);
        coupling[column] += std::abs(entry.value());
      }
      if (member == 3) break;
      double most = 0;
      for (const int candidate : candidates) {
        if (taken[candidate] || coupling[candidate] <= most) continue;
        most = coupling[candidate];
        group[member + 1] = candidate;
      }
    }
    for (const int candidate : candidates) coupling[candidate] = 0;
    groups.push_back(group);
  }
  return groups;
}

}  // namespace

RowGroups row_groups(const Matrix& matrix, std::span<const int> position) {
  RowGroups result;
  result.starts.push_back(0);
  std::vector<std::pair<int, std::array<double, 4>>> entries;
  std::vector<int> place(matrix.cols(), -1);
  for (const Group& group : group_rows(matrix)) {
    entries.clear();
    for (int member = 0; member < 4 && group[member] >= 0; ++member)
      for (Matrix::InnerIterator entry(matrix, group[member]); entry; ++entry) {
        int& at = place[entry.col()];
        if (at < 0) {
          at = static_cast<int>(entries.size());
          entries.push_back({static_cast<int>(entry.col()), {}});
        }
        entries[at].second[member] = entry.value();
      }
    for (auto& [column, values] : entries) {
      place[column] = -1;
      column = position[column];
    }
    std::sort(entries.begin(), entries.end());
    for (const auto& [column, values] : entries) {
      result.columns.push_back(column);
      result.values.insert(result.values.end(), values.begin(), values.end());
    }
    result.starts.push_back(static_cast<int>(result.columns.size()));
    Group numbered = group;
    for (int& row : numbered)
      if (row >= 0) row = position[row];
    result.rows.push_back(numbered);
  }
  result.single_values.assign(result.values.begin(), result.values.end());
  return result;
}

template <typename Scalar>
void add_product(const Kernels& kernels, const RowGroups& matrix, Scalar scale, const Scalar* x, Scalar* y) {
  if (matrix.empty()) return;
  const FourRows groups = {static_cast<int>(matrix.rows.size()), matrix.rows.front().data(),
                           matrix.starts.data(), matrix.columns.data()};
  const Scalar* values;
  if constexpr (std::is_same_v<Scalar, float>)
    values = matrix.single_values.data();
  else
    values = matrix.values.data();
  linear<Scalar>(kernels).add_rows(groups, values, scale, x, y);
}

template void add_product(const Kernels&, const RowGroups&, float, const float*, float*);
template void add_product(const Kernels&, const RowGroups&, double, const double*, double*);

}  // namespace flash::sim
