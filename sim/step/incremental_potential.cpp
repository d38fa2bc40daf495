#include "sim/step/incremental_potential.h"

#include <Eigen/Geometry>

#include "sim/step/hinge_energy.h"
#include "sim/step/membrane_damping.h"
#include "sim/step/rigid_turn.h"

namespace flash::sim {

using data::Points;
using Eigen::Vector3d;

IncrementalPotential::IncrementalPotential(const SheetPlan& plan, const BendingOperator& bending,
                                           const Environment& environment, double time_step)
    : plan_(plan),
      bending_(bending),
      environment_(environment),
      h_(time_step),
      damping_share_(environment.material.stiffness_damping / time_step) {
  const State& start = environment.state;
  mass_ = environment.material.areal_density * plan.sheet.vertex_area;
  target_ = start.positions + h_ * start.velocities;
  target_.rowwise() += h_ * h_ * environment.gravity.transpose();
  loads_ = Points::Zero(start.positions.rows(), 3);
  for (const Load& load : environment.loads) loads_.row(load.vertex) += load.force.transpose();
  if (damping_share_ == 0) return;
  start_metrics_ = triangle_metrics(plan, start.positions);
  if (bending.model != data::BendingModel::hinge) return;
  start_hinges_ = plan.hinges;
  for (Hinge& hinge : start_hinges_) {
    HingePositions x;
    for (int k = 0; k < 4; ++k) x.col(k) = start.positions.row(hinge.vertices[k]);
    hinge.rest_angle = hinge_angle(x);
  }
}

SheetLame IncrementalPotential::damping_lame() const {
  const data::SheetMaterial& material = environment_.material;
  SheetLame lame = sheet_lame(damping_share_ * material.membrane_stiffness, material.poissons_ratio);
  if (material.constitutive == data::Constitutive::tri_arap) lame.lambda = 0;
  return lame;
}

double IncrementalPotential::evaluate(const Points& positions, Points& force, ElasticEnergy& elastic) const {
  const Points inertial = positions - target_, moved = positions - environment_.state.positions;
  const double drag = environment_.material.air_drag / h_;
  force = mass_.asDiagonal() * (inertial / (h_ * h_) + drag * moved) - loads_;
  double potential = 0.5 / (h_ * h_) * (mass_.asDiagonal() * inertial).cwiseProduct(inertial).sum() +
                     0.5 * drag * (mass_.asDiagonal() * moved).cwiseProduct(moved).sum() -
                     loads_.cwiseProduct(moved).sum();
  if (damping_share_ > 0) potential += add_damping(positions, force);
  elastic = add_elastic_gradient(plan_, bending_, environment_.material, positions, force);
  return potential + elastic.membrane + elastic.bending;
}

double IncrementalPotential::at_start(const ElasticEnergy& elastic) const {
  const Points inertial = environment_.state.positions - target_;
  return 0.5 / (h_ * h_) * (mass_.asDiagonal() * inertial).cwiseProduct(inertial).sum() + elastic.membrane +
         elastic.bending;
}

double IncrementalPotential::add_damping(const Points& positions, Points& force) const {
  const double rigidity = damping_share_ * environment_.material.bending_rigidity;
  const double potential =
      add_membrane_damping_gradient(plan_, start_metrics_, damping_lame(), positions, force);
  if (bending_.model == data::BendingModel::hinge)
    return potential + add_hinge_gradient(start_hinges_, rigidity, positions, force);
  // Quadratic models know positions, not angles: what the sheet turned by as a whole is taken out.
  const RigidTurn turn(mass_, environment_.state.positions, positions);
  const Points bent = positions - turn.turned();
  Points damped = Points::Zero(positions.rows(), 3);
  add_bending_product(bending_, rigidity, bent, damped);
  Vector3d torque = Vector3d::Zero();
  for (Eigen::Index i = 0; i < positions.rows(); ++i)
    torque -= turn.turned().row(i).transpose().cross(damped.row(i).transpose());
  force += damped + turn.gradient(torque);
  return potential + 0.5 * damped.cwiseProduct(bent).sum();
}

double IncrementalPotential::effective_rigidity() const {
  return environment_.material.bending_rigidity * (1 + damping_share_);
}

void IncrementalPotential::assemble(const Points& positions, Curvature curvature, bool sparse,
                                    BlockValues<double>& values) const {
  values.assign(9 * (plan_.pattern.size + (sparse ? plan_.edge_count : plan_.pattern.pairs.size())), 0.0);
  add_elastic_hessian(plan_, bending_, environment_.material, positions, 1.0, curvature, values);
  if (damping_share_ > 0) {
    add_membrane_damping_hessian(plan_, start_metrics_, damping_lame(), positions, curvature, values);
    if (bending_.model == data::BendingModel::hinge)
      add_hinge_hessian(plan_, start_hinges_, damping_share_ * environment_.material.bending_rigidity,
                        positions, values);
  }
  const double per_mass = 1 / (h_ * h_) + environment_.material.air_drag / h_;
  for (int i = 0; i < plan_.pattern.size; ++i)
    for (int c = 0; c < 3; ++c) values[9L * i + 4 * c] += mass_[i] * per_mass;
}

}  // namespace flash::sim
