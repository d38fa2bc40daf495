#include "sim/step/elastic_energy.h"

#include "sim/cpu/kernels.h"

namespace flash::sim {

namespace {

using data::Points;
using Eigen::Matrix3d;

/// The membrane's part of the material.
Membrane membrane_of(const data::SheetMaterial& material) {
  return membrane_of(material.constitutive, sheet_lame(material.membrane_stiffness, material.poissons_ratio));
}

void add_block(BlockValues<double>& values, BlockSlot slot, const Matrix3d& block) {
  Eigen::Map<Matrix3d> target(values.data() + 9L * slot.block);
  if (slot.transpose)
    target += block.transpose();
  else
    target += block;
}

/// Four numbers a vertex.
using PaddedPoints = Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor>;

PaddedPoints padded_vertices(const Points& x) {
  PaddedPoints padded(x.rows(), 4);
  padded << x, Eigen::VectorXd::Zero(x.rows());
  return padded;
}

}  // namespace

ElasticEnergy add_elastic_gradient(const SheetPlan& plan, const BendingOperator& bending,
                                   const data::SheetMaterial& material, const data::Points& positions,
                                   data::Points& gradient) {
  ElasticEnergy energy;
  const Membrane membrane = membrane_of(material);
  energy.membrane = plan.kernels->add_membrane_gradient(
      membrane.law, membrane.lame, plan.triangle_groups.data(),
      static_cast<long>(plan.triangle_groups.size()), positions.data(), gradient.data());
  if (bending.model == data::BendingModel::hinge) {
    energy.bending = add_hinge_gradient(plan.hinges, material.bending_rigidity, positions, gradient);
    return energy;
  }
  // Far from the origin positions would round the energy: its differences between them are all that counts.
  const Points relative = positions.rowwise() - positions.row(0);
  Points bent = Points::Zero(positions.rows(), 3);
  add_bending_product(bending, material.bending_rigidity, relative, bent);
  gradient += bent;
  energy.bending = 0.5 * bent.cwiseProduct(relative).sum();
  return energy;
}

void add_elastic_hessian(const SheetPlan& plan, const BendingOperator& bending,
                         const data::SheetMaterial& material, const data::Points& positions, double scale,
                         Curvature curvature, BlockValues<double>& values) {
  const Membrane membrane = membrane_of(material);
  plan.kernels->add_membrane_hessian(membrane.law, membrane.lame, plan.triangle_groups.data(),
                                     static_cast<long>(plan.triangle_groups.size()), positions.data(), scale,
                                     curvature == Curvature::positive, values.data());
  if (bending.model == data::BendingModel::hinge)
    add_hinge_hessian(plan, plan.hinges, scale * material.bending_rigidity, positions, values);
}

double add_hinge_gradient(const std::vector<Hinge>& hinges, double rigidity, const Points& positions,
                          Points& gradient) {
  double energy = 0;
  for (const Hinge& hinge : hinges) {
    HingePositions x, hinge_gradient;
    for (int k = 0; k < 4; ++k) x.col(k) = positions.row(hinge.vertices[k]);
    double hinge_energy;
    hinge_response(hinge, x, hinge_energy, hinge_gradient, nullptr);
    energy += rigidity * hinge_energy;
    for (int k = 0; k < 4; ++k)
      gradient.row(hinge.vertices[k]) += rigidity * hinge_gradient.col(k).transpose();
  }
  return energy;
}

void add_hinge_hessian(const SheetPlan& plan, const std::vector<Hinge>& hinges, double rigidity,
                       const Points& positions, BlockValues<double>& values) {
  for (size_t e = 0; e < hinges.size(); ++e) {
    const Hinge& hinge = hinges[e];
    HingePositions x, hinge_gradient;
    for (int k = 0; k < 4; ++k) x.col(k) = positions.row(hinge.vertices[k]);
    double hinge_energy;
    Matrix12 hessian;
    hinge_response(hinge, x, hinge_energy, hinge_gradient, &hessian);
    for (int k = 0; k < 4; ++k)
      add_block(values, {hinge.vertices[k], false}, rigidity * hessian.block<3, 3>(3 * k, 3 * k));
    constexpr std::array<std::pair<int, int>, 6> blocks = {{{1, 0}, {2, 0}, {2, 1}, {3, 0}, {3, 1}, {3, 2}}};
    for (int b = 0; b < 6; ++b)
      add_block(values, plan.hinge_slots[e][b],
                rigidity * hessian.block<3, 3>(3 * blocks[b].first, 3 * blocks[b].second));
  }
}

void add_bending_stand_in(const BendingOperator& bending, double rigidity, BlockValues<double>& values) {
  for (size_t block = 0; block < bending.stand_in.size(); ++block)
    for (int c = 0; c < 3; ++c) values[9 * block + 4 * c] += rigidity * bending.stand_in[block];
}

void add_bending_product(const BendingOperator& bending, double rigidity, const Points& x, Points& y) {
  if (bending.stiffness.empty()) return;
  const PaddedPoints padded = padded_vertices(x);
  PaddedPoints product = PaddedPoints::Zero(x.rows(), 4);
  add_product(*bending.kernels, bending.stiffness, rigidity, padded.data(), product.data());
  y += product.leftCols<3>();
}

}  // namespace flash::sim
