#include "sim/cpu/row_groups.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <random>

#include "data/mesh/procedural_mesh.h"
#include "sim/plan/morley.h"

namespace flash::sim {
namespace {

using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;
template <typename Scalar>
using Rows = Eigen::Matrix<Scalar, Eigen::Dynamic, 4, Eigen::RowMajor>;

// Not symmetric; some rows are empty.
Matrix random_matrix(int size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> entry(-1, 1);
  std::uniform_int_distribution<int> column(0, size - 1), count(0, 7);
  std::vector<Eigen::Triplet<double>> entries;
  for (int row = 0; row < size; ++row)
    for (int k = count(random); k > 0; --k) entries.push_back({row, column(random), entry(random)});
  Matrix matrix(size, size);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

Matrix plate() {
  return plate_bending_stiffness(
      make_sheet(data::rectangle({0.2, 0.1, 12, 7, data::DiagonalPattern::one_way, 0.25, 1})), 0.3);
}

std::vector<int> shuffled(int size, unsigned seed) {
  std::vector<int> position(size);
  std::iota(position.begin(), position.end(), 0);
  std::shuffle(position.begin(), position.end(), std::mt19937(seed));
  return position;
}

// Against the sparse product row by row, to the rounding of a row's sum.
template <typename Scalar>
void expect_same_product(const Kernels& kernels, const Matrix& matrix, unsigned seed) {
  const int size = static_cast<int>(matrix.rows());
  const std::vector<int> position = shuffled(size, seed);
  const Eigen::MatrixX3d x = Eigen::MatrixX3d::Random(size, 3), y = Eigen::MatrixX3d::Random(size, 3);
  const double scale = 0.7;
  std::vector<Scalar> padded(4 * size, std::numeric_limits<Scalar>::quiet_NaN());
  Rows<Scalar> result = Rows<Scalar>::Zero(size, 4);
  for (int i = 0; i < size; ++i) {
    for (int c = 0; c < 3; ++c) padded[4 * position[i] + c] = static_cast<Scalar>(x(i, c));
    result.row(position[i]).template head<3>() = y.row(i).cast<Scalar>();
  }
  add_product(kernels, row_groups(matrix, position), static_cast<Scalar>(scale), padded.data(),
              result.data());
  const Eigen::MatrixX3d expected = y + scale * (matrix * x);
  const Eigen::MatrixX3d magnitude = y.cwiseAbs() + matrix.cwiseAbs() * x.cwiseAbs();
  for (int i = 0; i < size; ++i) {
    const double roundings = 4.0 + static_cast<double>(matrix.row(i).nonZeros());
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(result(position[i], c), expected(i, c),
                  roundings * std::numeric_limits<Scalar>::epsilon() * magnitude(i, c))
          << "row " << i << " of " << size;
  }
}

TEST(RowGroups, ProductIsThatOfTheSparseMatrix) {
  for (const InstructionLevel level : instruction_levels()) {
    SCOPED_TRACE(to_string(level));
    const Kernels& kernels = kernels_of(level);
    for (const int size : {1, 2, 3, 4, 5, 17, 64}) {
      SCOPED_TRACE(size);
      expect_same_product<float>(kernels, random_matrix(size, 10 + size), size);
      expect_same_product<double>(kernels, random_matrix(size, 10 + size), size);
    }
    expect_same_product<float>(kernels, plate(), 3);
    expect_same_product<double>(kernels, plate(), 3);
  }
}

TEST(RowGroups, EachRowStandsOnce) {
  const RowGroups groups = row_groups(plate(), shuffled(static_cast<int>(plate().rows()), 5));
  std::vector<int> rows;
  for (const auto& group : groups.rows)
    std::copy_if(group.begin(), group.end(), std::back_inserter(rows), [](int row) { return row >= 0; });
  std::sort(rows.begin(), rows.end());
  std::vector<int> all(plate().rows());
  std::iota(all.begin(), all.end(), 0);
  EXPECT_EQ(rows, all);
}

// What it is for: a vertex is loaded for four rows, not for each.
TEST(RowGroups, RowsOfAGroupShareTheirColumns) {
  const Matrix matrix = plate();
  const RowGroups groups = row_groups(matrix, shuffled(static_cast<int>(matrix.rows()), 5));
  EXPECT_LT(4.0 * groups.columns.size(), 1.6 * matrix.nonZeros());
}

}  // namespace
}  // namespace flash::sim
