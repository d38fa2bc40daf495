#pragma once
#include <Eigen/Core>
#include <vector>

#include "sim/cpu/block_cholesky.h"
#include "sim/cpu/sheet_product.h"
#include "sim/newton/step_numbers.h"

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

/// P A x = P b over the free directions, P their projector. In the others x is given.
template <typename Scalar>
struct RestrictedProblem {
  SheetProduct<Scalar>& matrix;            ///< A
  BlockCholesky<float>& preconditioner;    ///< factor of a positive definite matrix near P A P
  std::vector<VertexMatrix<Scalar>> free;  ///< P
  OrderedVector<Scalar> right;             ///< b
  OrderedVector<Scalar> start;             ///< x to begin with; what is not free stays
  double tolerance;                        ///< residual that is small enough; so is `enough` of the first
  int most_solves = sim::most_solves;      ///< iterations of conjugate gradients
};

/// x <- M x, by the matrices of some vertices.
template <typename Scalar>
void apply(const std::vector<VertexMatrix<Scalar>>& matrices, OrderedVector<Scalar>& x) {
  for (const VertexMatrix<Scalar>& matrix : matrices) {
    auto own = x.template segment<4>(4L * matrix.position);
    own = (matrix.columns.col(0) * own[0] + matrix.columns.col(1) * own[1] + matrix.columns.col(2) * own[2])
              .eval();
  }
}

template <typename Scalar>
struct KrylovSolution {
  OrderedVector<Scalar> x, image;  ///< x and A x
  int solves = 0;                  ///< with the preconditioner
  double first_residual = 0;       ///< norm of that at the start
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
