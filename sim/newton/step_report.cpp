#include "sim/newton/step_report.h"

#include <algorithm>
#include <cmath>

#include "data/numbers/worst.h"
#include "sim/newton/step_end.h"
#include "sim/newton/step_problem.h"

namespace flash::sim {

using data::Points;
using data::worst;
using Eigen::Vector3d;

void report_contacts(const StepProblem& problem, const Iterate& end, StepReport& report) {
  const Environment& environment = problem.contacts.environment;
  report.hold_forces.assign(environment.holds.size(), Vector3d::Zero());
  report.obstacle_forces.assign(environment.obstacles.size(), Vector3d::Zero());
  for (size_t k = 0; k < end.contacts.constraints.size(); ++k) {
    const VertexConstraint& c = end.contacts.constraints[k];
    add_hold_forces(c, c.reaction, report.hold_forces);
    const std::span<const VertexTouch> touches = end.contacts.touches_of(k);
    for (size_t t = 0; t < touches.size(); ++t) {
      const VertexTouch& touch = touches[t];
      if (!touch.holds) continue;
      report.complementarity = worst(report.complementarity, touch.gap);
      report.obstacle_forces[problem.contacts.owners[t]] +=
          vector3d(touch.normal_force * touch.normal + touch.friction);
    }
  }
  for (const Spring& spring : problem.potential.springs())
    report.hold_forces[spring.hold] += spring.force(end.positions.row(spring.vertex));
  for (int i = 0; i < end.positions.rows(); ++i) {
    const VertexConstraint* c = end.contacts.find(i);
    // One that is held in some axes meets no obstacle in the others: such a step is not solved.
    if (c != nullptr && c->freedom == Freedom::held && is_zero(c->free)) continue;
    for (size_t k = 0; k < problem.contacts.obstacles.size(); ++k) {
      const SurfaceGap<double> gap = problem.contacts.gap(static_cast<int>(k), end.positions, i);
      const double depth = gap.starts_inside
                               ? -gap_to(problem.contacts.obstacles[k], vector3(end.positions, i)).distance
                               : -gap.distance;
      report.penetration_max = worst(report.penetration_max, depth);
      // A vertex that leaves slowly may stay below the surface.
      report.complementarity = worst(report.complementarity, -gap.distance);
    }
  }
  if (problem.layers) {
    report.layer_distance = end.layers.closest;
    report.layer_touches = static_cast<int>(end.layers.touches.size());
    report.layer_pairs = problem.layers->counts().pairs;
    report.layer_ways = problem.layers->counts().ways;
  }
  report.no_room = deepest_without_room(problem.contacts, end.contacts, end.positions);
  report.held_penetration = deepest_held(problem.contacts, end.contacts, end.positions);
  report.penetration_max = std::max(report.penetration_max, report.held_penetration.depth);
  report.start_penetration =
      deepest_at_start(problem.contacts, vertices_inside(problem.contacts, end.contacts));
}

bool account_for_energy(const StepProblem& problem, const ElasticEnergy& elastic_at_start, const Iterate& end,
                        StepReport& report) {
  const Environment& environment = problem.contacts.environment;
  const State& start = environment.state;
  const double h = problem.contacts.time_step;
  const Eigen::VectorXd& mass = problem.potential.mass();
  const Points moved = end.positions - start.positions;
  const auto kinetic_of = [&](const Points& velocities) {
    return 0.5 * (mass.asDiagonal() * velocities).cwiseProduct(velocities).sum();
  };
  report.kinetic = kinetic_of(moved / h);
  report.membrane = end.elastic.membrane;
  report.bending = end.elastic.bending;
  report.solid = end.elastic.solid;
  report.layers = end.elastic.layers;
  double falls = 0, unbalanced = 0, bristles = 0;
  bool start_is_feasible = report.start_penetration.depth == 0;
  for (int i = 0; i < mass.size(); ++i) {
    const Vector3d way = moved.row(i);
    report.gravitational -= mass[i] * environment.gravity.dot(end.positions.row(i));
    falls += mass[i] * environment.gravity.dot(way);
    unbalanced += std::abs(end.residual.row(i).dot(way));
  }
  for (size_t k = 0; k < end.contacts.constraints.size(); ++k) {
    const VertexConstraint& c = end.contacts.constraints[k];
    const Vector3<double> way = vector3(moved, c.vertex);
    if (c.freedom == Freedom::held) {
      report.work += dot(c.reaction, way);
      start_is_feasible = start_is_feasible && is_zero(way - c.free * way);
    }
    if (k >= end.contacts.held)
      bristles += bristle_energy(problem.contacts.view_of(c.vertex), end.contacts.touches_of(k).data());
    for (const VertexTouch& touch : end.contacts.touches_of(k)) {
      if (!touch.holds) continue;
      const Vector3<double> force = touch.normal_force * touch.normal + touch.friction;
      // The obstacle pushes out a vertex that starts inside, even where it stands still.
      report.work += touch.starts_inside ? std::max(0.0, dot(force, way)) : dot(force, touch.surface_moved);
    }
  }
  // Springs are no part of the sheet: what they store and give back is work that is done on it.
  for (const Spring& spring : problem.potential.springs())
    report.work += spring.force(end.positions.row(spring.vertex)).dot(moved.row(spring.vertex));
  if (problem.layers) bristles += problem.layers->bristle_energy(end.layers);
  for (const Load& load : environment.loads) falls += load.force.dot(moved.row(load.vertex));
  for (const MovingObstacle<double>& obstacle : problem.contacts.obstacles)
    start_is_feasible = start_is_feasible && !obstacle.moves;

  const double stored_at_start = elastic_at_start.total(), stored_at_end = end.elastic.total();
  const double kinetic_at_start = kinetic_of(start.velocities);
  double rounding = rounding_of_weight(mass.sum(), problem.gravity);
  for (const BodyLaw& law : problem.laws) {
    const double body_mass = rows_of(law.place.body, mass).sum();
    if (law.solid == nullptr) rounding += 2 * law.material.bending_rigidity * law.bending.flat_energy;
    rounding +=
        law.solid != nullptr
            ? rounding_of_membrane(body_mass, law.solid->youngs_modulus, law.solid->density)
            : rounding_of_membrane(body_mass, law.material.largest_stiffness(), law.material.areal_density);
  }
  const EnergyAccount energy = {kinetic_at_start, report.kinetic, stored_at_start, stored_at_end, falls,
                                report.work,      unbalanced,     bristles,        rounding};
  if (!energy.balances()) return false;
  if (!start_is_feasible) return true;
  return end.incremental_potential <= problem.potential.at_start(elastic_at_start) + energy.allowed();
}

void add_work(const StepReport& given_up, StepReport& report) {
  report.iterations += given_up.iterations;
  report.solves += given_up.solves;
  report.factorizations += given_up.factorizations;
  report.layer_pairs = std::max(report.layer_pairs, given_up.layer_pairs);
  report.layer_ways += given_up.layer_ways;
}

namespace {

const Penetration& deeper(const Penetration& a, const Penetration& b) { return a.depth >= b.depth ? a : b; }

}  // namespace

StepReport joined(const StepReport& first, const StepReport& second) {
  StepReport whole = second;
  whole.residual = worst(first.residual, second.residual);
  whole.iterations += first.iterations;
  whole.solves += first.solves;
  whole.factorizations += first.factorizations;
  whole.substeps += first.substeps;
  whole.converged = first.converged && second.converged;
  whole.penetration_max = worst(first.penetration_max, second.penetration_max);
  whole.held_penetration = deeper(first.held_penetration, second.held_penetration);
  whole.start_penetration = first.start_penetration;
  whole.no_room = deeper(first.no_room, second.no_room);
  whole.layer_distance = std::min(first.layer_distance, second.layer_distance);
  whole.layer_pairs = std::max(first.layer_pairs, second.layer_pairs);
  whole.layer_ways += first.layer_ways;
  whole.complementarity = worst(first.complementarity, second.complementarity);
  whole.yielding += first.yielding;
  whole.work += first.work;
  for (size_t k = 0; k < whole.hold_forces.size(); ++k)
    whole.hold_forces[k] = 0.5 * (first.hold_forces[k] + second.hold_forces[k]);
  for (size_t k = 0; k < whole.obstacle_forces.size(); ++k)
    whole.obstacle_forces[k] = 0.5 * (first.obstacle_forces[k] + second.obstacle_forces[k]);
  return whole;
}

}  // namespace flash::sim
