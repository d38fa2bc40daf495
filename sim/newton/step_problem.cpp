#include "sim/newton/step_problem.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "data/numbers/worst.h"
#include "sim/law/least_weight.h"
#include "sim/newton/step_numbers.h"

namespace flash::sim {

namespace {

/// Which vertices holds carry in all axes.
std::vector<bool> carried_vertices(const ContactSet& contacts) {
  std::vector<bool> carried(contacts.place.size(), false);
  for (std::size_t k = 0; k < contacts.held; ++k)
    carried[contacts.constraints[k].vertex] = is_zero(contacts.constraints[k].free);
  return carried;
}

}  // namespace

StepProblem::StepProblem(const SheetPlan& plan, const Environment& environment, double h,
                         const WayOut<double>& way_out, LayerMemory* memory)
    : laws(body_laws(plan, environment)),
      potential(plan, laws, environment, h),
      contacts(plan.sheet, environment, h, way_out),
      gravity(environment.gravity.norm() > 0 ? environment.gravity.norm() : weight_of_nothing),
      time_step(h) {
  for (const BodyLaw& law : laws) {
    force_scales.push_back(rows_of(law.place.body, potential.mass()).norm() * gravity);
    stiffnesses.push_back(largest_stiffness(law, h));
  }
  if (memory == nullptr) return;
  data::Points positions = environment.state.positions;
  layers =
      std::make_unique<LayerStep>(*memory, environment, h, carried_vertices(begin_step(contacts, positions)));
}

double StepProblem::relative_residual(const Iterate& iterate) const {
  double largest = 0;
  for (std::size_t b = 0; b < laws.size(); ++b)
    largest = data::worst(largest, rows_of(laws[b].place.body, iterate.residual).norm() / force_scales[b]);
  return largest;
}

void StepProblem::evaluate(Iterate& iterate) const {
  iterate.materials = contacts.environment.materials;
  iterate.solids = contacts.environment.solids;
  iterate.rest_angles = contacts.environment.state.rest_angles;
  iterate.incremental_potential = potential.evaluate(iterate.positions, iterate.force, iterate.elastic);
  if (layers) {
    layers->add_forces(iterate.positions, iterate.layers, iterate.force);
    iterate.elastic.layers = iterate.layers.energy;
    iterate.incremental_potential += iterate.layers.energy;
  }
  update_contacts(contacts, iterate.positions, iterate.force, iterate.contacts);
  iterate.residual = iterate.force;
  for (const VertexConstraint& constraint : iterate.contacts.constraints)
    iterate.residual.row(constraint.vertex) -= vector3d(constraint.reaction).transpose();
}

bool StepProblem::balanced(const Iterate& iterate, double tolerance) const {
  for (std::size_t b = 0; b < laws.size(); ++b) {
    const Body& body = laws[b].place.body;
    const double least_mass =
        least_vertex_share * rows_of(body, potential.mass()).sum() / static_cast<double>(body.vertex_count);
    double squared_rounding = 0;
    for (int i = body.first_vertex; i < body.first_vertex + body.vertex_count; ++i) {
      const VertexConstraint* c = iterate.contacts.find(i);
      const double mass = potential.mass()[i], weight = std::max(mass, least_mass) * gravity,
                   uncertain = std::numeric_limits<double>::epsilon() * iterate.positions.row(i).norm(),
                   held = (c == nullptr ? 0 : norm(c->slip_stiffness)) +
                          potential.spring_stiffness().row(i).norm(),
                   rounding = uncertain * held +
                              std::min(uncertain * (stiffnesses[b] + mass / (time_step * time_step)),
                                       most_rounding * weight);
      if (!(iterate.residual.row(i).norm() <= vertex_tolerance * tolerance * weight + rounding)) return false;
      squared_rounding += rounding * rounding;
    }
    if (!(rows_of(body, iterate.residual).norm() <=
          tolerance * force_scales[b] + std::sqrt(squared_rounding)))
      return false;
  }
  return true;
}

bool StepProblem::rests(const Iterate& start, double tolerance) const {
  return relative_residual(start) <= start_tolerance_share * tolerance;
}

}  // namespace flash::sim
