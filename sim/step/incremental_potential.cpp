#include "sim/step/incremental_potential.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "sim/step/hinge_energy.h"
#include "sim/step/rigid_turn.h"
#include "sim/step/solid_damping.h"
#include "sim/step/strain_energy.h"

namespace flash::sim {

using data::Points;
using Eigen::Vector3d;

IncrementalPotential::IncrementalPotential(const SheetPlan& plan, const std::vector<BodyLaw>& laws,
                                           const Environment& environment, double time_step)
    : plan_(plan),
      laws_(laws),
      environment_(environment),
      h_(time_step),
      mass_(plan.sheet.vertex_area),
      springs_(springs_of(environment, environment.state.time + time_step)) {
  const State& start = environment.state;
  for (const BodyLaw& law : laws)
    if (law.solid != nullptr)
      rows_of(law.place.body, mass_) = law.solid->density * rows_of(law.place.body, plan.sheet.vertex_volume);
    else
      rows_of(law.place.body, mass_) *= law.material.areal_density;
  for (const PointMass& point : environment.point_masses) mass_[point.vertex] += point.mass;
  target_ = start.positions + h_ * start.velocities;
  target_.rowwise() += h_ * h_ * environment.gravity.transpose();
  loads_ = Points::Zero(start.positions.rows(), 3);
  for (const Load& load : environment.loads) loads_.row(load.vertex) += load.force.transpose();
  spring_stiffness_ = Points::Zero(start.positions.rows(), 3);
  for (const Spring& spring : springs_)
    spring_stiffness_.row(spring.vertex) += spring.stiffness * spring.acts.matrix().transpose();
  const auto damped = [](const BodyLaw& law) { return law.stiffness_damping() > 0; };
  if (std::none_of(laws.begin(), laws.end(), damped)) return;
  start_metrics_ = triangle_metrics(plan, start.positions);
  solid_start_metrics_ = solid_metrics(plan, start.positions);
  start_hinges_ = plan.hinges;
  for (Hinge& hinge : start_hinges_) {
    HingePositions x;
    for (int k = 0; k < 4; ++k) x.col(k) = start.positions.row(hinge.vertices[k]);
    hinge.rest_angle = hinge_angle(x);
  }
}

SheetStiffness IncrementalPotential::damping_stiffness(const BodyLaw& law) const {
  return SheetStiffness(law.material) * damping_share(law);
}

SolidLame IncrementalPotential::solid_damping_lame(const BodyLaw& law) const {
  const SolidLame lame = solid_of(*law.solid).lame;
  return {damping_share(law) * lame.mu, damping_share(law) * lame.lambda};
}

double IncrementalPotential::evaluate(const Points& positions, Points& force, ElasticEnergy& elastic) const {
  const Points inertial = positions - target_, moved = positions - environment_.state.positions;
  force = mass_.asDiagonal() * (inertial / (h_ * h_)) - loads_;
  double potential = 0.5 / (h_ * h_) * (mass_.asDiagonal() * inertial).cwiseProduct(inertial).sum() -
                     loads_.cwiseProduct(moved).sum();
  elastic = {};
  for (const BodyLaw& law : laws_) {
    potential += add_drag(law, moved, force);
    if (law.stiffness_damping() > 0) potential += add_damping(law, positions, force);
    elastic += add_elastic_gradient(plan_, law, positions, force);
  }
  for (const Spring& spring : springs_) {
    const Vector3d x = positions.row(spring.vertex);
    force.row(spring.vertex) -= spring.force(x).transpose();
    potential += spring.energy(x);
  }
  return potential + elastic.membrane + elastic.bending + elastic.solid;
}

double IncrementalPotential::at_start(const ElasticEnergy& elastic) const {
  const Points& start = environment_.state.positions;
  const Points inertial = start - target_;
  double springs = 0;
  for (const Spring& spring : springs_) springs += spring.energy(start.row(spring.vertex));
  return 0.5 / (h_ * h_) * (mass_.asDiagonal() * inertial).cwiseProduct(inertial).sum() + elastic.membrane +
         elastic.bending + elastic.solid + elastic.layers + springs;
}

void IncrementalPotential::pull(double share, Points& positions) const {
  if (springs_.empty()) return;
  const Points& start = environment_.state.positions;
  Points weight = (mass_ / (h_ * h_)).replicate(1, 3);
  for (const Spring& spring : springs_)
    for (int axis = 0; axis < 3; ++axis) {
      const double own = spring.stiffness * spring.acts[axis];
      const double place = start(spring.vertex, axis) + share * (spring.place[axis] - spring.before[axis]);
      double& whole = weight(spring.vertex, axis);
      whole += own;
      positions(spring.vertex, axis) += own / whole * (place - positions(spring.vertex, axis));
    }
}

double IncrementalPotential::add_drag(const BodyLaw& law, const Points& moved, Points& force) const {
  if (law.air_drag() == 0) return 0;
  const auto own_moved = rows_of(law.place.body, moved);
  const Points dragged = law.air_drag() / h_ * (rows_of(law.place.body, mass_).asDiagonal() * own_moved);
  rows_of(law.place.body, force) += dragged;
  return 0.5 * dragged.cwiseProduct(own_moved).sum();
}

double IncrementalPotential::add_damping(const BodyLaw& law, const Points& positions, Points& force) const {
  const Body& body = law.place.body;
  if (law.solid != nullptr)
    return add_solid_damping_gradient(plan_, body, solid_start_metrics_, solid_damping_lame(law), positions,
                                      force);
  const double rigidity = damping_share(law) * law.material.bending_rigidity;
  const double potential =
      add_strain_gradient(plan_, law.place, start_metrics_, damping_stiffness(law), positions, force);
  if (law.bends_at_hinges())
    return potential + add_hinge_gradient(hinges_of(law.place, start_hinges_), {rigidity}, positions, force);
  // Quadratic models know positions, not angles: what the body turned by as a whole is taken out.
  const Points own = rows_of(body, positions);
  const RigidTurn turn(rows_of(body, mass_), rows_of(body, environment_.state.positions), own);
  const Points bent = own - turn.turned();
  const Points damped = bending_product(law.bending, rigidity, bent);
  Vector3d torque = Vector3d::Zero();
  for (Eigen::Index i = 0; i < own.rows(); ++i)
    torque -= turn.turned().row(i).transpose().cross(damped.row(i).transpose());
  rows_of(body, force) += damped + turn.gradient(torque);
  return potential + 0.5 * damped.cwiseProduct(bent).sum();
}

double IncrementalPotential::effective_rigidity(const BodyLaw& law) const {
  return law.material.bending_rigidity * (1 + damping_share(law));
}

void IncrementalPotential::assemble(const Points& positions, Curvature curvature, bool sparse,
                                    BlockValues<double>& values) const {
  values.assign(9 * (plan_.pattern.size + (sparse ? plan_.edge_count : plan_.pattern.pairs.size())), 0.0);
  for (const BodyLaw& law : laws_) {
    add_elastic_hessian(plan_, law, positions, 1.0, curvature, values);
    if (law.stiffness_damping() > 0 && law.solid != nullptr) {
      add_solid_damping_hessian(plan_, law.place.body, solid_start_metrics_, solid_damping_lame(law),
                                positions, curvature, values);
    } else if (law.stiffness_damping() > 0) {
      add_strain_hessian(plan_, law.place, start_metrics_, damping_stiffness(law), positions, curvature,
                         values);
      if (law.bends_at_hinges())
        add_hinge_hessian(plan_, law.place, hinges_of(law.place, start_hinges_),
                          {damping_share(law) * law.material.bending_rigidity}, positions, values);
    }
    const double per_mass = 1 / (h_ * h_) + law.air_drag() / h_;
    const Body& body = law.place.body;
    for (int i = body.first_vertex; i < body.first_vertex + body.vertex_count; ++i)
      for (int c = 0; c < 3; ++c) values[9L * i + 4 * c] += mass_[i] * per_mass + spring_stiffness_(i, c);
  }
}

}  // namespace flash::sim
