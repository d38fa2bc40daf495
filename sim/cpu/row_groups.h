#pragma once
#include <Eigen/SparseCore>
#include <array>
#include <span>
#include <vector>

#include "sim/cpu/instruction_level.h"

namespace flash::sim {

/// A sparse matrix over vertices that acts on each coordinate alike. Its rows go four at a time over the
/// columns that any of them has: block compressed rows, blocks of 4 x 1. Rows next to each other share most
/// of their columns, and a vertex that was loaded serves four rows.
struct RowGroups {
  std::vector<std::array<int, 4>> rows;  ///< rows of each group, -1 where it has fewer
  std::vector<int> starts;               ///< where each group starts in `columns`, and where the last ends
  std::vector<int> columns;
  std::vector<double> values;  ///< four a column, one for each row of the group
  std::vector<float> single_values;

  bool empty() const { return rows.empty(); }
};

/// Groups the rows of `matrix`; `position` numbers the vertices of the result.
RowGroups row_groups(const Eigen::SparseMatrix<double, Eigen::RowMajor>& matrix,
                     std::span<const int> position);

/// y += scale * S x. Four numbers a vertex, of which the last is any.
template <typename Scalar>
void add_product(const Kernels& kernels, const RowGroups& matrix, Scalar scale, const Scalar* x, Scalar* y);

extern template void add_product(const Kernels&, const RowGroups&, float, const float*, float*);
extern template void add_product(const Kernels&, const RowGroups&, double, const double*, double*);

}  // namespace flash::sim
