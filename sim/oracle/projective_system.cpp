#include "sim/oracle/projective_system.h"

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "data/files/error.h"
#include "sim/law/membrane.h"
#include "sim/plan/isometric_bending.h"
#include "sim/plan/morley.h"

namespace flash::sim {

using Eigen::VectorXd;

namespace {

/// Turns the areas in `mass` into masses for one body, and adds its part of the matrix.
void add_body(const Sheet& sheet, const Body& body, const data::SheetMaterial& material, double h,
              VectorXd& mass, std::vector<Eigen::Triplet<double>>& entries) {
  rows_of(body, mass) *= material.areal_density;
  const double stiffness_scale = h * h + h * material.stiffness_damping;
  const SheetLame lame = sheet_lame(material.membrane_stiffness, material.poissons_ratio);
  const double weight = material.constitutive == data::Constitutive::tri_arap
                            ? 2 * lame.mu
                            : 2 * lame.mu + 2 * std::max(lame.lambda, 0.0);
  const int first = body.first_vertex;
  for (int i = first; i < first + body.vertex_count; ++i)
    entries.emplace_back(i, i, mass[i] * (1 + h * material.air_drag));
  const Sheet alone = body_alone(sheet, body);
  for (const RestTriangle& triangle : alone.triangles) {
    Eigen::Matrix<double, 3, 2> gradient;
    gradient.bottomRows<2>() = triangle.inverse_edges;
    gradient.row(0) = -gradient.row(1) - gradient.row(2);
    const Eigen::Matrix3d local = stiffness_scale * weight * triangle.area * gradient * gradient.transpose();
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        entries.emplace_back(first + triangle.vertices[a], first + triangle.vertices[b], local(a, b));
  }
  const Eigen::SparseMatrix<double> bending =
      material.bending_model == data::BendingModel::plate
          ? condensed_plate(alone, material.poissons_ratio, {}, 1e-2, material.weave).stiffness
          : isometric_bending_stiffness(alone);
  for (int column = 0; column < bending.outerSize(); ++column)
    for (Eigen::SparseMatrix<double>::InnerIterator entry(bending, column); entry; ++entry)
      entries.emplace_back(first + static_cast<int>(entry.row()), first + column,
                           stiffness_scale * material.bending_rigidity * entry.value());
}

}  // namespace

struct ProjectiveSystem::Factor {
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> llt;
};

ProjectiveMatrix projective_matrix(const SheetPlan& plan, const std::vector<data::SheetMaterial>& materials,
                                   double time_step) {
  ProjectiveMatrix made{plan.sheet.vertex_area, {}};
  std::vector<Eigen::Triplet<double>> entries;
  for (const data::SheetMaterial& material : materials) {
    if (std::isfinite(material.yield_curvature))
      throw data::InputError(
          "yield_curvature: bending does not yield under the projective method, expected newton");
    if (material.weave.is_of_membrane())
      throw data::InputError(
          "young_ratio, shear_ratio: membranes are isotropic under the projective method, expected newton");
  }
  for (std::size_t b = 0; b < materials.size(); ++b)
    add_body(plan.sheet, plan.sheet.bodies[b], materials[b], time_step, made.mass, entries);
  made.matrix.resize(made.mass.size(), made.mass.size());
  made.matrix.setFromTriplets(entries.begin(), entries.end());
  return made;
}

ProjectiveSystem::ProjectiveSystem(const SheetPlan& plan, const std::vector<data::SheetMaterial>& materials,
                                   double time_step)
    : factor_(std::make_unique<Factor>()) {
  ProjectiveMatrix made = projective_matrix(plan, materials, time_step);
  mass_ = std::move(made.mass);
  matrix_.swap(made.matrix);
  factor_->llt.compute(matrix_);
  if (factor_->llt.info() != Eigen::Success)
    throw data::InputError(
        "material: the system matrix is not positive definite: areal_density has to be above 0, "
        "bending_rigidity not below");
  columns_.resize(mass_.size());
}

ProjectiveSystem::~ProjectiveSystem() = default;
ProjectiveSystem::ProjectiveSystem(ProjectiveSystem&&) noexcept = default;

const VectorXd& ProjectiveSystem::column(int vertex) const {
  if (columns_[vertex].size() == 0)
    columns_[vertex] = factor_->llt.solve(VectorXd::Unit(mass_.size(), vertex));
  return columns_[vertex];
}

void ProjectiveSystem::hold(const std::array<std::vector<int>, 3>& held) {
  for (int axis = 0; axis < 3; ++axis) {
    Held& own = held_[axis];
    if (own.vertices == held[axis]) continue;
    own.vertices = held[axis];
    const auto same = std::find_if(held_.begin(), held_.begin() + axis,
                                   [&](const Held& other) { return other.vertices == own.vertices; });
    if (same != held_.begin() + axis) {
      own.response = same->response;
      continue;
    }
    const Eigen::Index n = static_cast<Eigen::Index>(own.vertices.size());
    Eigen::MatrixXd rows(n, mass_.size()), compliance(n, n);
    for (Eigen::Index k = 0; k < n; ++k) rows.row(k) = column(own.vertices[k]);
    for (Eigen::Index k = 0; k < n; ++k) compliance.col(k) = rows.col(own.vertices[k]);
    own.response = n > 0 ? Eigen::MatrixXd(compliance.llt().solve(rows)) : rows;
  }
}

data::Points ProjectiveSystem::solve(const data::Points& b) const {
  Eigen::MatrixXd right = b;
  for (int axis = 0; axis < 3; ++axis) {
    const Held& own = held_[axis];
    if (own.vertices.empty()) continue;
    const VectorXd reaction = own.response * right.col(axis);
    for (std::size_t k = 0; k < own.vertices.size(); ++k) right(own.vertices[k], axis) -= reaction[k];
  }
  data::Points x = factor_->llt.solve(right);
  for (int axis = 0; axis < 3; ++axis)
    for (const int vertex : held_[axis].vertices) x(vertex, axis) = 0;
  return x;
}

Eigen::Vector3d ProjectiveSystem::inverse(int i, int j) const {
  const VectorXd& column_j = column(j);
  Eigen::Vector3d value = Eigen::Vector3d::Constant(column_j[i]);
  for (int axis = 0; axis < 3; ++axis) {
    const Held& own = held_[axis];
    for (std::size_t k = 0; k < own.vertices.size(); ++k)
      value[axis] -= column_j[own.vertices[k]] * own.response(k, i);
  }
  return value;
}

}  // namespace flash::sim
