#include "sim/step/elastic_energy.h"

#include "sim/cpu/kernels.h"
#include "sim/step/hinge_energy.h"

namespace flash::sim {

namespace {

using data::Points;

/// The membrane's part of the material.
Membrane membrane_of(const data::SheetMaterial& material) {
  return membrane_of(material.constitutive, sheet_lame(material.membrane_stiffness, material.poissons_ratio));
}

/// Positions with four numbers a vertex, the last zero.
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
