#include "sim/step/elastic_energy.h"

#include "sim/cpu/kernels.h"
#include "sim/step/hinge_energy.h"
#include "sim/step/solid_energy.h"
#include "sim/step/strain_energy.h"

namespace flash::sim {

namespace {

using data::Points;

/// The membrane's part of the material.
Membrane membrane_of(const data::SheetMaterial& material) {
  return membrane_of(material.constitutive, sheet_lame(material.membrane_stiffness, material.poissons_ratio));
}

double add_membrane_gradient(const SheetPlan& plan, const BodyLaw& law, const Points& positions,
                             Points& gradient) {
  const BodyPlan& place = law.place;
  if (law.material.weave.is_of_membrane())
    return add_strain_gradient(plan, place, {}, SheetStiffness(law.material), positions, gradient);
  const Membrane membrane = membrane_of(law.material);
  return plan.kernels->add_membrane_gradient(membrane.law, membrane.lame,
                                             plan.triangle_groups.data() + place.first_group,
                                             place.group_count, positions.data(), gradient.data());
}

void add_membrane_hessian(const SheetPlan& plan, const BodyLaw& law, const Points& positions, double scale,
                          Curvature curvature, BlockValues<double>& values) {
  const BodyPlan& place = law.place;
  if (law.material.weave.is_of_membrane())
    return add_strain_hessian(plan, place, {}, SheetStiffness(law.material) * scale, positions, curvature,
                              values);
  const Membrane membrane = membrane_of(law.material);
  plan.kernels->add_membrane_hessian(
      membrane.law, membrane.lame, plan.triangle_groups.data() + place.first_group, place.group_count,
      positions.data(), scale, curvature == Curvature::positive, values.data());
}

/// Positions with four numbers a vertex, the last zero.
using PaddedPoints = Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor>;

PaddedPoints padded_vertices(const Points& x) {
  PaddedPoints padded(x.rows(), 4);
  padded << x, Eigen::VectorXd::Zero(x.rows());
  return padded;
}

/// With the rest angles that hold: those of the plan where a law was made without a state.
std::span<const Hinge> hinges_in(const SheetPlan& plan, const BodyLaw& law) {
  return law.hinges.empty() ? hinges_of(law.place, plan.hinges) : law.hinges_now();
}

}  // namespace

ElasticEnergy add_elastic_gradient(const SheetPlan& plan, const BodyLaw& law, const Points& positions,
                                   Points& gradient) {
  ElasticEnergy energy;
  const BodyPlan& place = law.place;
  if (law.solid != nullptr) {
    energy.solid = add_solid_gradient(plan, place.body, solid_of(*law.solid), positions, gradient);
    return energy;
  }
  energy.membrane = add_membrane_gradient(plan, law, positions, gradient);
  if (law.bends_at_hinges()) {
    energy.bending = add_hinge_gradient(hinges_in(plan, law),
                                        {law.material.bending_rigidity, law.material.yield_curvature},
                                        positions, gradient);
    return energy;
  }
  // Far from the origin positions would round the energy: its differences between them are all that counts.
  const Points relative = rows_of(place.body, positions).rowwise() - positions.row(place.body.first_vertex);
  const Points bent = bending_product(law.bending, law.material.bending_rigidity, relative);
  rows_of(place.body, gradient) += bent;
  energy.bending = 0.5 * bent.cwiseProduct(relative).sum();
  return energy;
}

void add_elastic_hessian(const SheetPlan& plan, const BodyLaw& law, const Points& positions, double scale,
                         Curvature curvature, BlockValues<double>& values) {
  if (law.solid != nullptr)
    return add_solid_hessian(plan, law.place.body, solid_of(*law.solid), positions, scale, curvature, values);
  add_membrane_hessian(plan, law, positions, scale, curvature, values);
  if (law.bends_at_hinges())
    add_hinge_hessian(plan, law.place, hinges_in(plan, law),
                      {scale * law.material.bending_rigidity, law.material.yield_curvature}, positions,
                      values);
}

void add_bending_stand_in(const BendingOperator& bending, double rigidity, BlockValues<double>& values) {
  for (size_t block = 0; block < bending.stand_in.size(); ++block)
    for (int c = 0; c < 3; ++c) values[9 * block + 4 * c] += rigidity * bending.stand_in[block];
}

Points bending_product(const BendingOperator& bending, double rigidity, const Points& x) {
  if (bending.stiffness.empty()) return Points::Zero(x.rows(), 3);
  const PaddedPoints padded = padded_vertices(x);
  PaddedPoints product = PaddedPoints::Zero(x.rows(), 4);
  add_product(*bending.kernels, bending.stiffness, rigidity, padded.data(), product.data());
  return product.leftCols<3>();
}

}  // namespace flash::sim
