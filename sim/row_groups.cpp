#include "sim/row_groups.h"

#ifdef __AVX512F__
#include <immintrin.h>
#endif

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "sim/lanes.h"

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

/// sums += what the group's columns `first` to `end` contribute: four numbers for each of four rows.
template <typename Scalar>
void add_columns(const int* columns, const Scalar* values, int first, int end, const Scalar* x,
                 Scalar* sums) {
  using Four = typename FourOf<Scalar>::type;
  Four rows[4] = {};
  for (int k = first; k < end; ++k) {
    const Four vertex = load_four(x + 4L * columns[k]);
    for (int row = 0; row < 4; ++row) rows[row] += values[4L * k + row] * vertex;
  }
  for (int row = 0; row < 4; ++row) store_four(rows[row], sums + 4 * row);
}

#ifdef __AVX512F__
/// The same in one vector for all four rows: two loads and a permutation for sixteen multiply-adds.
void add_columns(const int* columns, const float* values, int first, int end, const float* x, float* sums) {
  const __m512i row_of_lane = _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
  __m512 partial[4] = {_mm512_setzero_ps(), _mm512_setzero_ps(), _mm512_setzero_ps(), _mm512_setzero_ps()};
  const auto add = [&](int k, __m512& sum) {
    const __m512 entries = _mm512_castps128_ps512(_mm_loadu_ps(values + 4L * k));
    sum = _mm512_fmadd_ps(_mm512_permutexvar_ps(row_of_lane, entries),
                          _mm512_broadcast_f32x4(_mm_loadu_ps(x + 4L * columns[k])), sum);
  };
  int k = first;
  for (; k + 3 < end; k += 4)
    for (int part = 0; part < 4; ++part) add(k + part, partial[part]);
  for (; k < end; ++k) add(k, partial[0]);
  _mm512_storeu_ps(sums, (partial[0] + partial[1]) + (partial[2] + partial[3]));
}
#endif

}  // namespace

RowGroups row_groups(const Matrix& matrix, const std::vector<int>& position) {
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
void add_product(const RowGroups& matrix, Scalar scale, const Scalar* x, Scalar* y) {
  const Scalar* values;
  if constexpr (std::is_same_v<Scalar, float>)
    values = matrix.single_values.data();
  else
    values = matrix.values.data();
  for (size_t g = 0; g < matrix.rows.size(); ++g) {
    Scalar sums[16];
    add_columns(matrix.columns.data(), values, matrix.starts[g], matrix.starts[g + 1], x, sums);
    for (int member = 0; member < 4; ++member) {
      const int row = matrix.rows[g][member];
      if (row < 0) break;
      for (int c = 0; c < 3; ++c) y[3L * row + c] += scale * sums[4 * member + c];
    }
  }
}

template void add_product(const RowGroups&, float, const float*, float*);
template void add_product(const RowGroups&, double, const double*, double*);

}  // namespace flash::sim
