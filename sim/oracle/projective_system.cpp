#include "sim/oracle/projective_system.h"

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <algorithm>

#include "data/error.h"
#include "sim/law/membrane.h"
#include "sim/plan/isometric_bending.h"
#include "sim/plan/morley.h"

namespace flash::sim {

using Eigen::VectorXd;

struct ProjectiveSystem::Factor {
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> llt;
};

ProjectiveSystem::ProjectiveSystem(const SheetPlan& plan, const data::SheetMaterial& material,
                                   double time_step)
    : mass_(material.areal_density * plan.sheet.vertex_area), factor_(std::make_unique<Factor>()) {
  const double h = time_step;
  const double stiffness_scale = h * h + h * material.stiffness_damping;
  const SheetLame lame = sheet_lame(material.membrane_stiffness, material.poissons_ratio);
  const double weight = material.constitutive == data::Constitutive::tri_arap
                            ? 2 * lame.mu
                            : 2 * lame.mu + 2 * std::max(lame.lambda, 0.0);
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < mass_.size(); ++i) entries.emplace_back(i, i, mass_[i] * (1 + h * material.air_drag));
  for (const RestTriangle& triangle : plan.sheet.triangles) {
    Eigen::Matrix<double, 3, 2> gradient;
    gradient.bottomRows<2>() = triangle.inverse_edges;
    gradient.row(0) = -gradient.row(1) - gradient.row(2);
    const Eigen::Matrix3d local = stiffness_scale * weight * triangle.area * gradient * gradient.transpose();
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        entries.emplace_back(triangle.vertices[a], triangle.vertices[b], local(a, b));
  }
  matrix_.resize(mass_.size(), mass_.size());
  matrix_.setFromTriplets(entries.begin(), entries.end());
  const double D = stiffness_scale * material.bending_rigidity;
  if (material.bending_model == data::BendingModel::plate)
    matrix_ += D * plate_bending_stiffness(plan.sheet, material.poissons_ratio, 1e-2);
  else
    matrix_ += D * isometric_bending_stiffness(plan.sheet);
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
