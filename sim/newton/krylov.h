#pragma once
#include <Eigen/Core>
#include <vector>

#include "sim/cpu/block_cholesky.h"
#include "sim/cpu/sheet_product.h"

namespace flash::sim {

/// Vertices in elimination order, four numbers each, the last of them zero.
template <typename Scalar>
using OrderedVector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;

/// A 3 x 3 matrix that acts on one vertex; those of a list act on its vertices and leave the others.
template <typename Scalar>
struct VertexMatrix {
  int position;                         ///< of the vertex in the elimination
  Eigen::Matrix<Scalar, 4, 3> columns;  ///< of four numbers, the last zero

  VertexMatrix(int position_in, const Eigen::Matrix3d& matrix) : position(position_in) {
    columns << matrix.cast<Scalar>(), Eigen::Matrix<Scalar, 1, 3>::Zero();
  }
};

/// Share of the first residual of a linear problem that is small enough. Twice of it takes as many solves a
/// step and more Newton iterations (docs/performance.md).
inline constexpr double enough_of_first = 0.05;

/// P A x = P b over the free directions, P their projector. In the others x is given.
template <typename Scalar>
struct RestrictedProblem {
  SheetProduct<Scalar>& matrix;            ///< A
  BlockCholesky<float>& preconditioner;    ///< factor of a positive definite matrix near P A P
  std::vector<VertexMatrix<Scalar>> free;  ///< P
  OrderedVector<Scalar> right;             ///< b
  OrderedVector<Scalar> start;             ///< x, zero in the free directions
  double tolerance;                        ///< residual that is small enough
  int most_solves = 20;                    ///< iterations of conjugate gradients
  double enough = enough_of_first;         ///< share of the first residual that is small enough too
  // The solution and the first residual of a problem like this one, from which conjugate gradients go on.
  OrderedVector<Scalar> last = {};
  double first_norm = 0;  ///< 0: there is none
};

template <typename Scalar>
struct KrylovSolution {
  OrderedVector<Scalar> x, image;  ///< x and A x
  int solves = 0;                  ///< with the preconditioner
  double first_norm = 0;           ///< residual that the problem, or the one before it, began with
};

/// Conjugate gradients for a symmetric A; they stop where it curves down (Steihaug 1983).
template <typename Scalar>
KrylovSolution<Scalar> conjugate_gradients(const RestrictedProblem<Scalar>& problem, const Kernels& kernels);

/// The generalized minimal residual method (Saad and Schultz 1986) for L A x = P b. The list L has matrices
/// for the vertices of `problem.free`.
template <typename Scalar>
KrylovSolution<Scalar> gmres(const RestrictedProblem<Scalar>& problem,
                             const std::vector<VertexMatrix<Scalar>>& left);

extern template KrylovSolution<float> conjugate_gradients(const RestrictedProblem<float>&, const Kernels&);
extern template KrylovSolution<double> conjugate_gradients(const RestrictedProblem<double>&, const Kernels&);
extern template KrylovSolution<float> gmres(const RestrictedProblem<float>&,
                                            const std::vector<VertexMatrix<float>>&);
extern template KrylovSolution<double> gmres(const RestrictedProblem<double>&,
                                             const std::vector<VertexMatrix<double>>&);

}  // namespace flash::sim
