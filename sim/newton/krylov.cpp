#include "sim/newton/krylov.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "sim/cpu/kernels.h"

namespace flash::sim {
namespace {

void precondition(BlockCholesky<float>& factor, const OrderedVector<float>& residual, OrderedVector<float>&,
                  OrderedVector<float>& result) {
  result = residual;
  factor.solve_in_order(result.data());
}

void precondition(BlockCholesky<float>& factor, const OrderedVector<double>& residual,
                  OrderedVector<float>& single, OrderedVector<double>& result) {
  const double size = residual.cwiseAbs().maxCoeff();  // out of the range of single precision at times
  single = (residual / size).cast<float>();
  factor.solve_in_order(single.data());
  result = size * single.cast<double>();
}

}  // namespace

template <typename Scalar>
KrylovSolution<Scalar> conjugate_gradients(const RestrictedProblem<Scalar>& problem,
                                           const Kernels& all_kernels) {
  using Vector = OrderedVector<Scalar>;
  const LinearKernels<Scalar>& kernels = linear<Scalar>(all_kernels);
  const long size = problem.right.size();
  Vector residual = problem.right, preconditioned(size), search(size), image(size);
  OrderedVector<float> single(size);
  KrylovSolution<Scalar> solution{problem.start, Vector::Zero(size)};
  if (!problem.start.isZero(0)) {
    problem.matrix.multiply(solution.x.data(), solution.image.data());
    residual -= solution.image;
  }
  apply(problem.free, residual);
  const auto norm_of = [&](const Vector& v) { return std::sqrt(kernels.dot(size, v.data(), v.data())); };
  Scalar norm = norm_of(residual), previous = 0;
  solution.first_residual = norm;
  const Scalar target = std::max(Scalar(enough) * norm, static_cast<Scalar>(problem.tolerance));
  while (norm > target && solution.solves < problem.most_solves) {
    const bool first = solution.solves++ == 0;
    precondition(problem.preconditioner, residual, single, preconditioned);
    apply(problem.free, preconditioned);
    const Scalar along = kernels.dot(size, residual.data(), preconditioned.data());
    if (first)
      search = preconditioned;
    else
      kernels.scale_and_add(size, along / previous, preconditioned.data(), search.data());
    previous = along;
    problem.matrix.multiply(search.data(), image.data());
    const Scalar curvature = kernels.dot(size, search.data(), image.data());
    // Where the sheet is about to buckle the matrix is indefinite, and what was found so far leads down.
    if (curvature <= 0 && !first) break;
    const Scalar step = curvature > 0 ? along / curvature : Scalar(1);
    kernels.add_scaled(size, step, search.data(), solution.x.data());
    kernels.add_scaled(size, step, image.data(), solution.image.data());
    if (curvature <= 0) break;
    apply(problem.free, image);
    kernels.add_scaled(size, -step, image.data(), residual.data());
    norm = norm_of(residual);
  }
  return solution;
}

template <typename Scalar>
KrylovSolution<Scalar> gmres(const RestrictedProblem<Scalar>& problem,
                             const std::vector<VertexMatrix<Scalar>>& left) {
  using Vector = OrderedVector<Scalar>;
  const long size = problem.right.size();
  Vector residual = problem.right, image(size), preconditioned(size);
  OrderedVector<float> single(size);
  KrylovSolution<Scalar> solution{problem.start, Vector(size)};
  apply(problem.free, residual);
  if (!problem.start.isZero(0)) {
    problem.matrix.multiply(problem.start.data(), image.data());
    apply(left, image);
    residual -= image;
  }
  const Scalar norm = residual.norm();
  const Scalar target = std::max(Scalar(enough) * norm, static_cast<Scalar>(problem.tolerance));
  if (norm > target) {
    Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> basis(size, most_directions + 1),
        directions(size, most_directions);
    Eigen::MatrixXd hessenberg = Eigen::MatrixXd::Zero(most_directions + 1, most_directions);
    Eigen::VectorXd weights;
    int& count = solution.solves;
    basis.col(0) = residual / norm;
    for (double rest = norm; count < most_directions && rest > target;) {
      precondition(problem.preconditioner, basis.col(count), single, preconditioned);
      apply(problem.free, preconditioned);
      directions.col(count) = preconditioned;
      problem.matrix.multiply(preconditioned.data(), image.data());
      apply(left, image);
      for (int k = 0; k <= count; ++k) {
        hessenberg(k, count) = basis.col(k).dot(image);
        image -= static_cast<Scalar>(hessenberg(k, count)) * basis.col(k);
      }
      const Scalar length = image.norm();
      hessenberg(count + 1, count) = length;
      if (length > 0) basis.col(count + 1) = image / length;
      ++count;
      Eigen::VectorXd right = Eigen::VectorXd::Zero(count + 1);
      right[0] = norm;
      const Eigen::MatrixXd small = hessenberg.topLeftCorner(count + 1, count);
      weights = small.colPivHouseholderQr().solve(right);
      rest = (right - small * weights).norm();
      if (!(length > 0)) break;
    }
    for (int k = 0; k < count; ++k) solution.x += static_cast<Scalar>(weights[k]) * directions.col(k);
  }
  problem.matrix.multiply(solution.x.data(), solution.image.data());
  return solution;
}

template KrylovSolution<float> conjugate_gradients(const RestrictedProblem<float>&, const Kernels&);
template KrylovSolution<double> conjugate_gradients(const RestrictedProblem<double>&, const Kernels&);
template KrylovSolution<float> gmres(const RestrictedProblem<float>&,
                                     const std::vector<VertexMatrix<float>>&);
template KrylovSolution<double> gmres(const RestrictedProblem<double>&,
                                      const std::vector<VertexMatrix<double>>&);

}  // namespace flash::sim
