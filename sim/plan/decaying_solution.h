#pragma once
#include <Eigen/SparseCore>

namespace flash::sim {

/// A^-1 B without its small entries, for a positive definite A whose inverse decays away from the diagonal.
/// An entry stays where it is at least the limit of its row, or where B has one. `places` of the columns of B
/// say which lie close together: such share the rows about them that they are solved on, the rest at zero.
///
/// Those rows grow until no row next to them would move by more than a thousandth of its limit. The error is
/// what such moves make of all rows: at most |A^-1| diag(A) limits / 1000, and far less away from there.
/// Limits of zero are exact. Otherwise time and memory grow with the number of columns, not with its square.
Eigen::SparseMatrix<double, Eigen::RowMajor> decaying_solution(const Eigen::SparseMatrix<double>& A,
                                                               const Eigen::SparseMatrix<double>& B,
                                                               const Eigen::VectorXd& limits,
                                                               const Eigen::Matrix2Xd& places);

}  // namespace flash::sim
