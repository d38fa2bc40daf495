#include "sim/newton/newton_matrix.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/cpu/kernels.h"

namespace flash::sim {
namespace {

using data::Points;

constexpr double neighbours = 6;  ///< of a vertex, in a regular mesh

/// Vertices in elimination order, four numbers each, the last of them zero.
template <typename Scalar>
using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;

/// A vertex that may not move in every direction.
template <typename Scalar>
struct Restriction {
  int position;
  Eigen::Matrix<Scalar, 4, 3> free;  ///< columns of four numbers, the last zero

  Restriction(int position_in, const Eigen::Matrix3d& free_in) : position(position_in) {
    free << free_in.cast<Scalar>(), Eigen::Matrix<Scalar, 1, 3>::Zero();
  }
};

template <typename Scalar>
void restrict_to_free(const std::vector<Restriction<Scalar>>& restrictions, Vector<Scalar>& x) {
  for (const Restriction<Scalar>& restriction : restrictions) {
    auto own = x.template segment<4>(4L * restriction.position);
    own = (restriction.free.col(0) * own[0] + restriction.free.col(1) * own[1] +
           restriction.free.col(2) * own[2])
              .eval();
  }
}

void precondition(BlockCholesky<float>& factor, const Vector<float>& residual, Vector<float>&,
                  Vector<float>& result) {
  result = residual;
  factor.solve_in_order(result.data());
}

void precondition(BlockCholesky<float>& factor, const Vector<double>& residual, Vector<float>& single,
                  Vector<double>& result) {
  const double size = residual.cwiseAbs().maxCoeff();  // out of the range of single precision at times
  single = (residual / size).cast<float>();
  factor.solve_in_order(single.data());
  result = size * single.cast<double>();
}

}  // namespace

NewtonMatrix::NewtonMatrix(std::shared_ptr<const SheetPlan> plan)
    : plan_(std::move(plan)),
      factor_(plan_->symbolic, *plan_->kernels),
      single_product_(*plan_->kernels),
      double_product_(*plan_->kernels) {}

void NewtonMatrix::assign(const BlockValues<double>& blocks, bool sparse, const BendingOperator& bending,
                          double rigidity, double least_eigenvalue) {
  // Only blocks between vertices count: friction's stiffness, large where slip starts, rounds in its own
  // vertex's block alone.
  double largest = rigidity * bending.largest_entry;
  for (size_t k = plan_->pattern.size; k < plan_->pattern.size + plan_->edge_count; ++k)
    for (int c = 0; c < 3; ++c) largest = std::max(largest, std::abs(blocks[9 * k + 4 * c]));
  single_ = std::numeric_limits<float>::epsilon() * neighbours * largest < 0.01 * least_eigenvalue;
  const ProductPattern& pattern = sparse ? plan_->triangle_product : plan_->full_product;
  if (single_)
    single_product_.assign(pattern, blocks, bending.elimination_stiffness, rigidity);
  else
    double_product_.assign(pattern, blocks, bending.elimination_stiffness, rigidity);
}

int NewtonMatrix::solve(const ContactSet& contacts, const Points& gradient, double tolerance,
                        Points& direction, Points& force) {
  return single_ ? conjugate_gradients(single_product_, contacts, gradient, tolerance, direction, force)
                 : conjugate_gradients(double_product_, contacts, gradient, tolerance, direction, force);
}

int NewtonMatrix::solve_coupled(const ContactSet& contacts, const std::vector<Eigen::Matrix3d>& couplings,
                                const Points& gradient, double tolerance, Points& direction, Points& force) {
  return single_ ? generalized_minimal_residual(single_product_, contacts, couplings, gradient, tolerance,
                                                direction, force)
                 : generalized_minimal_residual(double_product_, contacts, couplings, gradient, tolerance,
                                                direction, force);
}

template <typename Scalar>
int NewtonMatrix::generalized_minimal_residual(SheetProduct<Scalar>& product, const ContactSet& contacts,
                                               const std::vector<Eigen::Matrix3d>& couplings,
                                               const Points& gradient, double tolerance, Points& direction,
                                               Points& force) {
  constexpr int most = 40;
  const std::vector<int>& position = elimination_position(*plan_->symbolic);
  const long size = 4 * gradient.rows();
  Vector<Scalar> residual = Vector<Scalar>::Zero(size), x = residual, image(size), preconditioned(size);
  Vector<float> single(size);
  std::vector<Restriction<Scalar>> free, coupled;
  for (int i = 0; i < gradient.rows(); ++i)
    residual.template segment<3>(4L * position[i]) = -gradient.row(i).transpose().cast<Scalar>();
  for (size_t k = 0; k < contacts.constraints.size(); ++k) {
    const VertexConstraint& constraint = contacts.constraints[k];
    if (constraint.hold == Hold::free) continue;
    const int i = position[constraint.vertex];
    const Eigen::Matrix3d coupling = k < couplings.size() ? couplings[k] : Eigen::Matrix3d::Zero();
    free.emplace_back(i, constraint.free);
    coupled.emplace_back(i, constraint.free + coupling);
    x.template segment<3>(4L * i) = constraint.correction.cast<Scalar>();
  }
  restrict_to_free(free, residual);
  if (!x.isZero(0)) {
    product.multiply(x.data(), image.data());
    restrict_to_free(coupled, image);
    residual -= image;
  }
  const Scalar norm = residual.norm();
  const Scalar target = std::max(Scalar(0.1) * norm, static_cast<Scalar>(tolerance));
  int count = 0;
  if (norm > target) {
    Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> basis(size, most + 1), directions(size, most);
    Eigen::MatrixXd hessenberg = Eigen::MatrixXd::Zero(most + 1, most);
    Eigen::VectorXd weights;
    basis.col(0) = residual / norm;
    for (double left = norm; count < most && left > target;) {
      precondition(factor_, basis.col(count), single, preconditioned);
      restrict_to_free(free, preconditioned);
      directions.col(count) = preconditioned;
      product.multiply(preconditioned.data(), image.data());
      restrict_to_free(coupled, image);
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
      left = (right - small * weights).norm();
      if (!(length > 0)) break;
    }
    for (int k = 0; k < count; ++k) x += static_cast<Scalar>(weights[k]) * directions.col(k);
  }
  product.multiply(x.data(), image.data());
  direction.resize(gradient.rows(), 3);
  for (int i = 0; i < direction.rows(); ++i) {
    direction.row(i) = x.template segment<3>(4L * position[i]).transpose().template cast<double>();
    force.row(i) += image.template segment<3>(4L * position[i]).transpose().template cast<double>();
  }
  return count;
}

template <typename Scalar>
int NewtonMatrix::conjugate_gradients(SheetProduct<Scalar>& product, const ContactSet& contacts,
                                      const Points& gradient, double tolerance, Points& direction,
                                      Points& force) {
  const std::vector<int>& position = elimination_position(*plan_->symbolic);
  const LinearKernels<Scalar>& kernels = linear<Scalar>(*plan_->kernels);
  const long size = 4 * gradient.rows();
  Vector<Scalar> residual = Vector<Scalar>::Zero(size), x = residual, change = residual;
  Vector<Scalar> preconditioned(size), search(size), image(size);
  Vector<float> single(size);
  std::vector<Restriction<Scalar>> restrictions;
  bool corrected = false;
  for (int i = 0; i < gradient.rows(); ++i)
    residual.template segment<3>(4L * position[i]) = -gradient.row(i).transpose().cast<Scalar>();
  for (const VertexConstraint& constraint : contacts.constraints) {
    if (constraint.hold == Hold::free) continue;
    const int i = position[constraint.vertex];
    restrictions.emplace_back(i, constraint.free);
    x.template segment<3>(4L * i) = constraint.correction.cast<Scalar>();
    corrected = corrected || !constraint.correction.isZero(0);
  }
  if (corrected) {
    product.multiply(x.data(), image.data());
    residual -= image;
    change += image;
  }
  restrict_to_free(restrictions, residual);
  const auto norm_of = [&](const Vector<Scalar>& v) {
    return std::sqrt(kernels.dot(size, v.data(), v.data()));
  };
  Scalar norm = norm_of(residual), previous = 0;
  const Scalar target = std::max(Scalar(0.1) * norm, static_cast<Scalar>(tolerance));
  int iteration = 0;
  while (norm > target && iteration < 20) {
    ++iteration;
    precondition(factor_, residual, single, preconditioned);
    restrict_to_free(restrictions, preconditioned);
    const Scalar along = kernels.dot(size, residual.data(), preconditioned.data());
    if (iteration == 1)
      search = preconditioned;
    else
      kernels.scale_and_add(size, along / previous, preconditioned.data(), search.data());
    previous = along;
    product.multiply(search.data(), image.data());
    const Scalar curvature = kernels.dot(size, search.data(), image.data());
    // Where the sheet is about to buckle the matrix is indefinite, and what was found so far leads down.
    if (curvature <= 0 && iteration > 1) break;
    const Scalar step = curvature > 0 ? along / curvature : Scalar(1);
    kernels.add_scaled(size, step, search.data(), x.data());
    kernels.add_scaled(size, step, image.data(), change.data());
    if (curvature <= 0) break;
    restrict_to_free(restrictions, image);
    kernels.add_scaled(size, -step, image.data(), residual.data());
    norm = norm_of(residual);
  }
  direction.resize(gradient.rows(), 3);
  for (int i = 0; i < direction.rows(); ++i) {
    direction.row(i) = x.template segment<3>(4L * position[i]).transpose().template cast<double>();
    force.row(i) += change.template segment<3>(4L * position[i]).transpose().template cast<double>();
  }
  return iteration;
}

}  // namespace flash::sim
