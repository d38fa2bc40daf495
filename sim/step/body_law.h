#pragma once
#include <cmath>
#include <span>
#include <vector>

#include "sim/plan/sheet_plan.h"
#include "sim/scene/environment.h"

namespace flash::sim {

/// What one body of an environment obeys: its place in the plan, its material, and the bending operator that
/// goes with both. Of a solid `material` is not read and `bending` is empty.
struct BodyLaw {
  const BodyPlan& place;
  const data::SheetMaterial& material;
  const BendingOperator& bending;
  const data::SolidMaterial* solid = nullptr;  ///< null: a sheet
  std::span<const Hinge> hinges = {};          ///< of the body, with the rest angles of the plan
  std::vector<Hinge> yielded = {};             ///< the same with those of the state, once one has yielded

  /// The hinges with the rest angles that hold.
  std::span<const Hinge> hinges_now() const { return yielded.empty() ? hinges : yielded; }
  bool yields() const { return solid == nullptr && std::isfinite(material.yield_curvature); }
  bool bends_at_hinges() const { return solid == nullptr && bending.model == data::BendingModel::hinge; }
  double air_drag() const { return solid != nullptr ? solid->air_drag : material.air_drag; }
  double stiffness_damping() const {
    return solid != nullptr ? solid->stiffness_damping : material.stiffness_damping;
  }
};

/// The largest entry on the diagonal of the stiffness of a sheet at rest, roughly [N/m]: its moduli times the
/// largest entries of the plan.
double largest_stiffness(const BodyPlan& place, const data::SheetMaterial& material,
                         const BendingOperator& bending);

/// The same of any body, with that of its damping over a step of `h` [s].
double largest_stiffness(const BodyLaw& law, double h);

/// The laws of all bodies, in the order of the plan. Plan and environment have to outlive them. Throws as
/// bending_operator does, data::InputError where a sheet yields whose bending model does not or
/// is woven whose membrane law is not, and std::invalid_argument where the solids of both are not the same.
std::vector<BodyLaw> body_laws(const SheetPlan& plan, const Environment& environment);

}  // namespace flash::sim
