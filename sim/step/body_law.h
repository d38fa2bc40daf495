#pragma once
#include <vector>

#include "sim/plan/sheet_plan.h"
#include "sim/scene/environment.h"

namespace flash::sim {

/// What one body of an environment obeys: its place in the plan, its material, and the bending operator that
/// goes with both.
struct BodyLaw {
  const BodyPlan& place;
  const data::SheetMaterial& material;
  const BendingOperator& bending;

  bool bends_at_hinges() const { return bending.model == data::BendingModel::hinge; }
};

/// The laws of all bodies, in the order of the plan. Plan and environment have to outlive them. Throws as
/// bending_operator does.
std::vector<BodyLaw> body_laws(const SheetPlan& plan, const Environment& environment);

}  // namespace flash::sim
