#include "sim/newton/newton_matrix.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace flash::sim {

using data::Points;

namespace {

constexpr double sheet_neighbours = 6, solid_neighbours = 14;  ///< of a vertex, in a regular linear mesh
constexpr int most_layered_solves = 100;                       ///< of a linear problem where layers touch
constexpr double little = 0.01;  ///< share of the least eigenvalue that rounding may change

/// The matrices on the vertices of the constraints: what each leaves free, and its coupling where there is
/// one.
template <typename Scalar>
std::vector<VertexMatrix<Scalar>> vertex_matrices(const ContactSet& contacts,
                                                  const std::vector<Eigen::Matrix3d>& couplings,
                                                  const std::vector<int>& position) {
  std::vector<VertexMatrix<Scalar>> matrices;
  for (size_t k = 0; k < contacts.constraints.size(); ++k) {
    const VertexConstraint& constraint = contacts.constraints[k];
    if (constraint.freedom == Freedom::free) continue;
    const Eigen::Matrix3d coupling = k < couplings.size() ? couplings[k] : Eigen::Matrix3d::Zero();
    matrices.emplace_back(position[constraint.vertex], matrix3d(constraint.free) + coupling);
  }
  return matrices;
}

}  // namespace

namespace {

template <typename Scalar>
std::vector<WeightedPart<Scalar>> weighted_parts(const std::vector<TouchStiffness>& layers,
                                                 const std::vector<int>& position) {
  std::vector<WeightedPart<Scalar>> parts(layers.size());
  for (size_t p = 0; p < layers.size(); ++p) {
    const LayerTouch& touch = layers[p].touch;
    for (size_t k = 0; k < 4; ++k) {
      parts[p].positions[k] = position[touch.vertices[k]];
      parts[p].weights[k] = static_cast<Scalar>(touch.weights[k]);
    }
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column)
        parts[p].block[3 * row + column] = static_cast<Scalar>(
            layers[p].stiffness.at(row, column) - layers[p].coupling[row] * touch.normal[column]);
  }
  return parts;
}

}  // namespace

NewtonMatrix::NewtonMatrix(std::shared_ptr<const SheetPlan> plan)
    : plan_(std::move(plan)),
      factor_(plan_->symbolic, *plan_->kernels),
      single_product_(*plan_->kernels),
      double_product_(*plan_->kernels) {}

void NewtonMatrix::assign(const BlockValues<double>& blocks, bool sparse,
                          const std::vector<ScaledBending>& bending, double least_eigenvalue,
                          const std::vector<TouchStiffness>& layers) {
  // Only blocks between vertices count: friction's stiffness, large where slip starts, rounds in its own
  // vertex's block alone.
  double largest = 0;
  std::vector<ScalarPart> scalar_parts;
  for (const auto& [operator_of_body, rigidity] : bending) {
    largest = std::max(largest, rigidity * operator_of_body.largest_entry);
    scalar_parts.push_back({&operator_of_body.elimination_stiffness, rigidity});
  }
  for (size_t k = plan_->pattern.size; k < plan_->pattern.size + plan_->edge_count; ++k)
    for (int c = 0; c < 3; ++c) largest = std::max(largest, std::abs(blocks[9 * k + 4 * c]));
  for (const TouchStiffness& layer : layers) largest = std::max(largest, norm(layer.stiffness));
  layered_ = !layers.empty();
  const double mean = 2.0 * static_cast<double>(plan_->edge_count) / plan_->pattern.size;
  const double neighbours = has_solids(plan_->sheet) ? std::max(solid_neighbours, mean) : sheet_neighbours;
  single_ = std::numeric_limits<float>::epsilon() * neighbours * largest < little * least_eigenvalue;
  const ProductPattern& pattern = sparse ? plan_->triangle_product : plan_->full_product;
  with_product([&]<typename Scalar>(SheetProduct<Scalar>& product) {
    product.assign(pattern, blocks, std::move(scalar_parts),
                   weighted_parts<Scalar>(layers, plan_->symbolic->position));
  });
}

template <typename Scalar>
RestrictedProblem<Scalar> NewtonMatrix::restricted(SheetProduct<Scalar>& product, const ContactSet& contacts,
                                                   const Points& gradient, double tolerance) {
  const std::vector<int>& position = plan_->symbolic->position;
  using Vector = OrderedVector<Scalar>;
  const long size = 4 * gradient.rows();
  RestrictedProblem<Scalar> problem{product,
                                    factor_,
                                    vertex_matrices<Scalar>(contacts, {}, position),
                                    Vector::Zero(size),
                                    Vector::Zero(size),
                                    tolerance,
                                    layered_ ? most_layered_solves : most_solves};
  for (int i = 0; i < gradient.rows(); ++i)
    problem.right.template segment<3>(4L * position[i]) = -gradient.row(i).transpose().cast<Scalar>();
  for (const VertexConstraint& constraint : contacts.constraints)
    if (constraint.freedom != Freedom::free)
      problem.start.template segment<3>(4L * position[constraint.vertex]) =
          vector3d(constraint.correction).cast<Scalar>();
  return problem;
}

template <typename Scalar>
void NewtonMatrix::start_from(const Points& direction, RestrictedProblem<Scalar>& problem) const {
  using Vector = OrderedVector<Scalar>;
  Vector free = Vector::Zero(problem.start.size());
  for (int i = 0; i < direction.rows(); ++i)
    free.template segment<3>(4L * plan_->symbolic->position[i]) =
        direction.row(i).transpose().template cast<Scalar>();
  flash::sim::apply(problem.free, free);
  problem.start += free;
}

template <typename Scalar>
int NewtonMatrix::take(const KrylovSolution<Scalar>& solution, Points& direction, Points& force) const {
  const std::vector<int>& position = plan_->symbolic->position;
  direction.resize(force.rows(), 3);
  for (int i = 0; i < direction.rows(); ++i) {
    direction.row(i) = solution.x.template segment<3>(4L * position[i]).transpose().template cast<double>();
    force.row(i) += solution.image.template segment<3>(4L * position[i]).transpose().template cast<double>();
  }
  return solution.solves;
}

int NewtonMatrix::solve(const ContactSet& contacts, const Points& gradient, double tolerance, bool goes_on,
                        Points& direction, Points& force) {
  return with_product([&](auto& product) {
    auto problem = restricted(product, contacts, gradient, tolerance);
    // Where layers press, the matrix curves down so often that what leads down with other contacts may not do
    // so with these.
    if (goes_on && !layered_) {
      start_from(direction, problem);
      problem.tolerance = std::max(tolerance, enough * first_residual_);
    }
    const auto solution = conjugate_gradients(problem, *plan_->kernels);
    if (!goes_on) first_residual_ = solution.first_residual;
    return take(solution, direction, force);
  });
}

int NewtonMatrix::solve_coupled(const ContactSet& contacts, const std::vector<Eigen::Matrix3d>& couplings,
                                const Points& gradient, double tolerance, Points& direction, Points& force) {
  return with_product([&]<typename Scalar>(SheetProduct<Scalar>& product) {
    const auto problem = restricted(product, contacts, gradient, tolerance);
    const auto left = vertex_matrices<Scalar>(contacts, couplings, plan_->symbolic->position);
    return take(gmres(problem, left), direction, force);
  });
}

}  // namespace flash::sim
