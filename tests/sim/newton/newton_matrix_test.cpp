#include "sim/newton/newton_matrix.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "sim/newton/active_set.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using data::Points;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

/// A positive definite matrix over a sheet, vertices as the mesh has them.
struct Example {
  std::shared_ptr<const SheetPlan> plan = make_sheet_plan(small_sheet(6));
  std::mt19937 random{11};
  int size = plan->pattern.size;
  BlockValues<double> values;

  Example() {
    const auto put = [&](const Matrix3d& block) {
      values.insert(values.end(), block.data(), block.data() + 9);
    };
    for (int i = 0; i < size; ++i) {
      const Matrix3d block = noise();
      put(block * block.transpose() + 30 * (1 + i % 7) * Matrix3d::Identity());
    }
    for (std::size_t k = 0; k < plan->pattern.pairs.size(); ++k) put(noise());
  }

  Matrix3d noise() {
    std::uniform_real_distribution<double> entry(-1, 1);
    return Matrix3d::NullaryExpr([&] { return entry(random); });
  }
  Points forces() {
    std::uniform_real_distribution<double> entry(-1, 1);
    return Points::NullaryExpr(size, 3, [&] { return entry(random); });
  }
};

MatrixXd dense(const BlockPattern& pattern, const BlockValues<double>& values) {
  MatrixXd matrix = MatrixXd::Zero(3L * pattern.size, 3L * pattern.size);
  const auto block = [&](std::size_t k) { return Eigen::Map<const Matrix3d>(values.data() + 9 * k); };
  for (int i = 0; i < pattern.size; ++i)
    matrix.block<3, 3>(3L * i, 3L * i) = block(static_cast<std::size_t>(i));
  for (std::size_t k = 0; k < pattern.pairs.size(); ++k) {
    const auto [i, j] = pattern.pairs[k];
    matrix.block<3, 3>(3L * i, 3L * j) = block(static_cast<std::size_t>(pattern.size) + k);
    matrix.block<3, 3>(3L * j, 3L * i) = matrix.block<3, 3>(3L * i, 3L * j).transpose();
  }
  return matrix;
}

/// Vertices that move in planes of these normals alone, each by its own way along the normal.
ContactSet on_planes(int size, const std::vector<std::pair<int, Vector3d>>& normals) {
  ContactSet contacts;
  contacts.place.assign(static_cast<std::size_t>(size), -1);
  for (const auto& [vertex, normal] : normals) {
    const Vector3d n = normal.normalized();
    VertexConstraint constraint;
    constraint.vertex = vertex;
    constraint.freedom = Freedom::slip;
    constraint.free = identity3() - square(Vector3<double>{n.x(), n.y(), n.z()});
    constraint.correction = 1e-3 * Vector3<double>{n.x(), n.y(), n.z()};
    contacts.place[static_cast<std::size_t>(vertex)] = static_cast<int>(contacts.constraints.size());
    contacts.constraints.push_back(constraint);
  }
  contacts.held = contacts.constraints.size();
  return contacts;
}

const std::vector<std::pair<int, Vector3d>> few = {{3, {0, 0, 1}}, {8, {1, 2, -1}}, {9, {0, 1, 1}}};
const std::vector<std::pair<int, Vector3d>> other = {{3, {0, 0, 1}}, {9, {0, 1, 1}}, {17, {1, 0, 2}}};

MatrixXd projector(const ContactSet& contacts, int size) {
  MatrixXd free = MatrixXd::Identity(3L * size, 3L * size);
  for (const VertexConstraint& c : contacts.constraints)
    free.block<3, 3>(3L * c.vertex, 3L * c.vertex) = matrix3d(c.free);
  return free;
}

TEST(NewtonMatrix, WhatContactsHoldKeepsItsOwnStiffnessInTheFactor) {
  Example example;
  const ContactSet contacts = on_planes(example.size, few);
  const MatrixXd whole = dense(example.plan->pattern, example.values),
                 free = projector(contacts, example.size);
  MatrixXd expected = free * whole * free;
  for (const VertexConstraint& c : contacts.constraints) {
    const Matrix3d held = Matrix3d::Identity() - matrix3d(c.free);
    expected.block<3, 3>(3L * c.vertex, 3L * c.vertex) +=
        held * whole.block<3, 3>(3L * c.vertex, 3L * c.vertex) * held;
  }
  BlockValues<double> values = example.values;
  restrict_matrix(example.plan->pattern, contacts, values);
  EXPECT_LT((dense(example.plan->pattern, values) - expected).norm(), 1e-13 * expected.norm());
}

/// Residual of a direction over the free directions.
double residual(const Example& example, const ContactSet& contacts, const Points& gradient,
                const Points& direction) {
  const auto vector = [](const Points& p) { return Eigen::Map<const Eigen::VectorXd>(p.data(), p.size()); };
  return (projector(contacts, example.size) *
          (dense(example.plan->pattern, example.values) * vector(direction) + vector(gradient)))
      .norm();
}

/// The free part of a direction, with the corrections.
Points start_of(const ContactSet& contacts, Points direction) {
  for (const VertexConstraint& c : contacts.constraints)
    direction.row(c.vertex) =
        (matrix3d(c.free) * direction.row(c.vertex).transpose() + vector3d(c.correction)).transpose();
  return direction;
}

TEST(NewtonMatrix, GoesOnFromTheDirectionOfOtherContacts) {
  Example example;
  NewtonMatrix matrix(example.plan);
  // The factor of the identity: far enough from the matrix to take several iterations.
  BlockValues<double> identity(example.values.size(), 0.0);
  for (int i = 0; i < example.size; ++i)
    for (int c = 0; c < 3; ++c)
      identity[9UL * static_cast<std::size_t>(i) + 4UL * static_cast<std::size_t>(c)] = 1;
  ASSERT_TRUE(matrix.factorize(identity));
  matrix.assign(example.values, false, {}, 1e3);
  const ContactSet first = on_planes(example.size, few), second = on_planes(example.size, other);
  const Points gradient = example.forces();
  Points direction, force = gradient;
  const int solves = matrix.solve(first, gradient, 0, false, direction, force);
  EXPECT_GT(solves, 2);
  const double enough_of_first =
      0.1 * residual(example, first, gradient, start_of(first, Points::Zero(example.size, 3)));
  // Entries of 200 and directions of 0.1, in single precision.
  constexpr double rounding = 1e-4;
  EXPECT_LE(residual(example, first, gradient, direction), enough_of_first + rounding);

  // Nothing is left to do where nothing has changed.
  force = gradient;
  EXPECT_EQ(matrix.solve(first, gradient, 0, true, direction, force), 0);

  Points anew, on = direction, force_on = gradient;
  force = gradient;
  const int solves_anew = matrix.solve(second, gradient, 0, false, anew, force);
  const int solves_on = matrix.solve(second, gradient, 0, true, on, force_on);
  EXPECT_LT(solves_on, solves_anew);
  const double enough_of_start = 0.1 * residual(example, second, gradient, start_of(second, direction));
  EXPECT_LE(residual(example, second, gradient, on), std::max(enough_of_first, enough_of_start) + rounding);
  for (const VertexConstraint& c : second.constraints)
    EXPECT_NEAR(on.row(c.vertex).dot(vector3d(c.correction).transpose()), 1e-6, 1e-9);
  // The force is that of the direction.
  const auto vector = [](const Points& p) { return Eigen::Map<const Eigen::VectorXd>(p.data(), p.size()); };
  EXPECT_LT((dense(example.plan->pattern, example.values) * vector(on) + vector(gradient) - vector(force_on))
                .norm(),
            rounding);
}

}  // namespace
}  // namespace flash::sim
