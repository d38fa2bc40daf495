#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/cuda/replay_numbers.h"
#include "sim/cuda/team.cuh"

namespace flash::sim::cuda {

// The factor of the serial team (team_factor.cuh): a dense U of the whole matrix, U^T U, row after row in
// double precision, in the memory that a device has numbers of half precision in.

inline constexpr int half_parts = 1;

/// Numbers of double precision in the factor of so many vertices.
inline long serial_factor_numbers(long vertices) { return 9 * vertices * vertices; }

inline bool factorize(const ReplayNumbers& replay, const TeamMemory& memory, float*) {
  const SheetTables& sheet = replay.sheet;
  const long rows = 3L * sheet.size;
  double* U = reinterpret_cast<double*>(memory.factor);
  std::fill(U, U + rows * rows, 0.0);
  for (int b = 0; b < sheet.block_count; ++b)
    for (int e = 0; e < 9; ++e) {
      const long row = 3L * sheet.block_rows[b] + e % 3, column = 3L * sheet.block_columns[b] + e / 3;
      U[rows * min(row, column) + max(row, column)] = memory.blocks[9L * b + e];
    }
  for (long k = 0; k < rows; ++k) {
    double* pivot = U + rows * k;
    if (!(pivot[k] > 0)) return false;
    const double root = std::sqrt(pivot[k]);
    for (long j = k; j < rows; ++j) pivot[j] /= root;
    for (long i = k + 1; i < rows; ++i) {
      if (pivot[i] == 0) continue;  // as most are
      for (long j = i; j < rows; ++j) U[rows * i + j] -= pivot[i] * pivot[j];
    }
  }
  return true;
}

/// There is but one environment.
inline __half* factor_of(const ReplayNumbers& replay, int) { return replay.factors; }

inline void put_zero(const FrontTables&, float*) {}

template <int parts, bool on_chip>
void solve(const FrontTables& tables, const __half* factor, float* vector, const char*) {
  const long rows = 3L * tables.size;
  const double* U = reinterpret_cast<const double*>(factor);
  std::vector<double> x(vector + rows, vector + 2 * rows);
  for (long i = 0; i < rows; ++i) {
    x[i] /= U[rows * i + i];
    for (long j = i + 1; j < rows; ++j) x[j] -= U[rows * i + j] * x[i];
  }
  for (long i = rows - 1; i >= 0; --i) {
    for (long j = i + 1; j < rows; ++j) x[i] -= U[rows * i + j] * x[j];
    x[i] /= U[rows * i + i];
  }
  std::transform(x.begin(), x.end(), vector + rows, [](double own) { return static_cast<float>(own); });
}

}  // namespace flash::sim::cuda
