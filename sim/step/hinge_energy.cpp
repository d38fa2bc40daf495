#include "sim/step/hinge_energy.h"

#include <array>
#include <cmath>
#include <utility>

namespace flash::sim {

using data::Points;
using Eigen::Matrix3d;

namespace {

void add_block(BlockValues<double>& values, BlockSlot slot, const Matrix3d& block) {
  Eigen::Map<Matrix3d> target(values.data() + 9L * slot.block);
  if (slot.transposed)
    target += block.transpose();
  else
    target += block;
}

}  // namespace

std::span<const Hinge> hinges_of(const BodyPlan& place, const std::vector<Hinge>& hinges) {
  return std::span(hinges).subspan(place.first_hinge, place.hinge_count);
}

HingeFlow hinge_flow(const SheetPlan& plan, const std::vector<BodyLaw>& laws, const State& start,
                     const Points& positions) {
  HingeFlow flow{start.rest_angles};
  for (const BodyLaw& law : laws) {
    if (!law.yields()) continue;
    const std::span<const Hinge> hinges = law.hinges_now();
    for (std::size_t e = 0; e < hinges.size(); ++e) {
      HingePositions x;
      for (int k = 0; k < 4; ++k) x.col(k) = positions.row(hinges[e].vertices[k]);
      const double limit = yield_angle(hinges[e], law.material.yield_curvature);
      const double change = flow_of(hinges[e], x, limit);
      if (change == 0) continue;
      if (flow.rest_angles.empty())
        for (const Hinge& hinge : plan.hinges) flow.rest_angles.push_back(hinge.rest_angle);
      flow.rest_angles[law.place.first_hinge + e] += change;
      flow.lost += law.material.bending_rigidity * hinges[e].weight * limit * std::abs(change);
    }
  }
  return flow;
}

double add_hinge_gradient(std::span<const Hinge> hinges, const HingeStiffness& stiffness,
                          const Points& positions, Points& gradient) {
  const double rigidity = stiffness.rigidity;
  double energy = 0;
  for (const Hinge& hinge : hinges) {
    HingePositions x, hinge_gradient;
    for (int k = 0; k < 4; ++k) x.col(k) = positions.row(hinge.vertices[k]);
    double hinge_energy;
    hinge_response(hinge, x, hinge_energy, hinge_gradient, nullptr,
                   yield_angle(hinge, stiffness.yield_curvature));
    energy += rigidity * hinge_energy;
    for (int k = 0; k < 4; ++k)
      gradient.row(hinge.vertices[k]) += rigidity * hinge_gradient.col(k).transpose();
  }
  return energy;
}

void add_hinge_hessian(const SheetPlan& plan, const BodyPlan& place, std::span<const Hinge> hinges,
                       const HingeStiffness& stiffness, const Points& positions,
                       BlockValues<double>& values) {
  const double rigidity = stiffness.rigidity;
  for (int e = place.first_hinge; e < place.first_hinge + place.hinge_count; ++e) {
    const Hinge& hinge = hinges[e - place.first_hinge];
    HingePositions x, hinge_gradient;
    for (int k = 0; k < 4; ++k) x.col(k) = positions.row(hinge.vertices[k]);
    double hinge_energy;
    Matrix12 hessian;
    hinge_response(hinge, x, hinge_energy, hinge_gradient, &hessian,
                   yield_angle(hinge, stiffness.yield_curvature));
    for (int k = 0; k < 4; ++k)
      add_block(values, {hinge.vertices[k], false}, rigidity * hessian.block<3, 3>(3 * k, 3 * k));
    constexpr std::array<std::pair<int, int>, 6> blocks = {{{1, 0}, {2, 0}, {2, 1}, {3, 0}, {3, 1}, {3, 2}}};
    for (int b = 0; b < 6; ++b)
      add_block(values, plan.hinge_slots[e][b],
                rigidity * hessian.block<3, 3>(3 * blocks[b].first, 3 * blocks[b].second));
  }
}

}  // namespace flash::sim
