#include "tests/prototype/row_matrix.h"

#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <utility>

namespace flash::sim {

using data::Points;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int most_directions = 200;   ///< of GMRES, which keeps all of them
constexpr double linear_share = 1e-2;  ///< of the first residual, to which it is solved

using Operator = std::function<VectorXd(const VectorXd&)>;

/// GMRES for matrix(x) = right with a preconditioner on the right (Saad and Schultz 1986). Returns x.
VectorXd gmres(const Operator& matrix, const Operator& precondition, const VectorXd& right, int& solves) {
  const double first = right.norm();
  VectorXd x = VectorXd::Zero(right.size());
  if (!(first > 0)) return x;
  MatrixXd basis(right.size(), most_directions + 1), directions(right.size(), most_directions);
  MatrixXd triangle = MatrixXd::Zero(most_directions + 1, most_directions);
  VectorXd rest = VectorXd::Zero(most_directions + 1);
  std::vector<Eigen::JacobiRotation<double>> turns;
  basis.col(0) = right / first;
  rest[0] = first;
  int count = 0;
  while (count < most_directions && std::abs(rest[count]) > linear_share * first) {
    directions.col(count) = precondition(basis.col(count));
    VectorXd next = matrix(directions.col(count));
    for (int k = 0; k <= count; ++k) {
      triangle(k, count) = basis.col(k).dot(next);
      next -= triangle(k, count) * basis.col(k);
    }
    const double length = next.norm();
    triangle(count + 1, count) = length;
    auto column = triangle.col(count);
    for (int k = 0; k < count; ++k) column.applyOnTheLeft(k, k + 1, turns[k].adjoint());
    turns.emplace_back();
    turns.back().makeGivens(column[count], column[count + 1]);
    column.applyOnTheLeft(count, count + 1, turns.back().adjoint());
    rest.applyOnTheLeft(count, count + 1, turns.back().adjoint());
    ++count;
    if (!(length > 0)) break;
    basis.col(count) = next / length;
  }
  solves += count;
  const VectorXd weights =
      triangle.topLeftCorner(count, count).triangularView<Eigen::Upper>().solve(rest.head(count));
  x = directions.leftCols(count) * weights;
  return x;
}

/// Applies the matrices of the constraints to their vertices: what they leave free, with `couplings` where
/// there are any.
void restrict_to_free(const ContactSet& contacts, const std::vector<Matrix3d>& couplings,
                      Eigen::Ref<VectorXd> x) {
  for (std::size_t k = 0; k < contacts.constraints.size(); ++k) {
    const VertexConstraint& constraint = contacts.constraints[k];
    if (constraint.freedom == Freedom::free) continue;
    Matrix3d matrix = matrix3d(constraint.free);
    if (k < couplings.size()) matrix += couplings[k];
    auto own = x.segment<3>(3L * constraint.vertex);
    own = (matrix * own).eval();
  }
}

}  // namespace

RowMatrix::RowMatrix(std::shared_ptr<const SheetPlan> plan)
    : plan_(std::move(plan)), factor_(plan_->symbolic, *plan_->kernels), product_(*plan_->kernels) {}

bool RowMatrix::factorize(const BlockValues<double>& positive) {
  diagonal_.resize(static_cast<std::size_t>(plan_->pattern.size));
  for (std::size_t i = 0; i < diagonal_.size(); ++i)
    diagonal_[i] = Eigen::Map<const Matrix3d>(positive.data() + 9 * i).inverse();
  return factor_.factorize(positive);
}

void RowMatrix::assign(const BlockValues<double>& blocks, bool sparse,
                       const std::vector<ScaledBending>& bending, const std::vector<TouchStiffness>& friction,
                       std::vector<ContactRow> rows) {
  std::vector<ScalarPart> scalar_parts;
  for (const auto& [operator_of_body, rigidity] : bending)
    scalar_parts.push_back({&operator_of_body.elimination_stiffness, rigidity});
  std::vector<WeightedPart<double>> parts(friction.size());
  for (std::size_t p = 0; p < parts.size(); ++p) {
    for (std::size_t k = 0; k < 4; ++k) {
      parts[p].positions[k] = plan_->symbolic->position[friction[p].touch.vertices[k]];
      parts[p].weights[k] = friction[p].touch.weights[k];
    }
    const Matrix3d block = matrix3d(friction[p].stiffness);
    for (int c = 0; c < 9; ++c) parts[p].block[c] = block(c / 3, c % 3);
  }
  product_.assign(sparse ? plan_->triangle_product : plan_->full_product, blocks, std::move(scalar_parts),
                  std::move(parts));
  rows_ = std::move(rows);
}

VectorXd RowMatrix::image(const VectorXd& motion) {
  const std::vector<int>& position = plan_->symbolic->position;
  OrderedVector<double> in = VectorXd::Zero(4L * plan_->pattern.size), out(in.size());
  for (int i = 0; i < plan_->pattern.size; ++i) in.segment<3>(4L * position[i]) = motion.segment<3>(3L * i);
  product_.multiply(in.data(), out.data());
  VectorXd result(motion.size());
  for (int i = 0; i < plan_->pattern.size; ++i) result.segment<3>(3L * i) = out.segment<3>(4L * position[i]);
  return result;
}

VectorXd RowMatrix::solved(const VectorXd& right) {
  const std::vector<int>& position = plan_->symbolic->position;
  const double size = right.cwiseAbs().maxCoeff();
  if (!(size > 0)) return right;
  OrderedVector<float> single = OrderedVector<float>::Zero(4L * plan_->pattern.size);
  for (int i = 0; i < plan_->pattern.size; ++i)
    single.segment<3>(4L * position[i]) = (right.segment<3>(3L * i) / size).cast<float>();
  factor_.solve_in_order(single.data());
  VectorXd result(right.size());
  for (int i = 0; i < plan_->pattern.size; ++i)
    result.segment<3>(3L * i) = size * single.segment<3>(4L * position[i]).cast<double>();
  return result;
}

VectorXd RowMatrix::push_of(const VectorXd& forces) const {
  VectorXd push = VectorXd::Zero(3L * plan_->pattern.size);
  for (std::size_t r = 0; r < rows_.size(); ++r)
    for (std::size_t k = 0; k < 4; ++k)
      push.segment<3>(3L * rows_[r].touch.vertices[k]) +=
          rows_[r].touch.weights[k] * forces[static_cast<long>(r)] * vector3d(rows_[r].push);
  return push;
}

VectorXd RowMatrix::parting(const VectorXd& motion) const {
  VectorXd parts = VectorXd::Zero(static_cast<long>(rows_.size()));
  for (std::size_t r = 0; r < rows_.size(); ++r)
    for (std::size_t k = 0; k < 4; ++k)
      parts[static_cast<long>(r)] +=
          rows_[r].touch.weights[k] *
          vector3d(rows_[r].touch.normal).dot(motion.segment<3>(3L * rows_[r].touch.vertices[k]));
  return parts;
}

int RowMatrix::solve(const ContactSet& contacts, const std::vector<Matrix3d>& couplings,
                     const Points& gradient, Points& direction, VectorXd& forces, Points& force) {
  const long size = 3L * gradient.rows(), rows = static_cast<long>(rows_.size());
  VectorXd gaps(rows), compliance(rows), schur(rows);
  for (long r = 0; r < rows; ++r) {
    const ContactRow& row = rows_[static_cast<std::size_t>(r)];
    const Eigen::Vector3d normal = vector3d(row.touch.normal);
    gaps[r] = row.gap;
    schur[r] = compliance[r] = row.compliance;
    for (int k = 0; k < 4; ++k) {
      const int i = row.touch.vertices[static_cast<std::size_t>(k)];
      Eigen::Vector3d along = row.touch.weights[k] * normal;
      if (const VertexConstraint* c = contacts.find(i)) along = matrix3d(c->free) * along;
      schur[r] += along.dot(diagonal_[static_cast<std::size_t>(i)] * along);
    }
  }
  VectorXd start = VectorXd::Zero(size);
  for (const VertexConstraint& c : contacts.constraints)
    if (c.freedom != Freedom::free) start.segment<3>(3L * c.vertex) = vector3d(c.correction);

  VectorXd right(size + rows);
  right.head(size) = -Eigen::Map<const VectorXd>(gradient.data(), size);
  restrict_to_free(contacts, {}, right.head(size));
  VectorXd given = image(start);
  restrict_to_free(contacts, couplings, given);
  right.head(size) -= given;
  right.tail(rows) = (gaps - parting(start)).cwiseQuotient(schur);

  const auto matrix = [&](const VectorXd& x) {
    VectorXd result(size + rows);
    result.head(size) = image(x.head(size)) - push_of(x.tail(rows));
    restrict_to_free(contacts, couplings, result.head(size));
    result.tail(rows) = (parting(x.head(size)) + compliance.cwiseProduct(x.tail(rows))).cwiseQuotient(schur);
    return result;
  };
  const auto precondition = [&](const VectorXd& x) {
    VectorXd pushed = x.head(size) + push_of(x.tail(rows)), result(size + rows);
    restrict_to_free(contacts, {}, pushed);
    pushed = solved(pushed);
    restrict_to_free(contacts, {}, pushed);
    result << pushed, x.tail(rows);
    return result;
  };
  int solves = 0;
  const VectorXd solution = gmres(matrix, precondition, right, solves);
  const VectorXd motion = start + solution.head(size);
  forces = solution.tail(rows);
  direction = Eigen::Map<const Points>(motion.data(), gradient.rows(), 3);
  const VectorXd change = image(motion) - push_of(forces);
  force += Eigen::Map<const Points>(change.data(), gradient.rows(), 3);
  return solves;
}

}  // namespace flash::sim
