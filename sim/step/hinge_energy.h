#pragma once
#include <span>
#include <vector>

#include "sim/plan/sheet_plan.h"

namespace flash::sim {

/// The hinges of a body among those of all bodies.
std::span<const Hinge> hinges_of(const BodyPlan& place, const std::vector<Hinge>& hinges);

/// Adds the gradient of hinges with rigidity D [N m] and returns their energy [J].
double add_hinge_gradient(std::span<const Hinge> hinges, double rigidity, const data::Points& positions,
                          data::Points& gradient);

/// Adds the Gauss-Newton part of the Hessian of a body's hinges. `hinges`: those of all bodies, as in the
/// plan but for their rest angles.
void add_hinge_hessian(const SheetPlan& plan, const BodyPlan& place, const std::vector<Hinge>& hinges,
                       double rigidity, const data::Points& positions, BlockValues<double>& values);

}  // namespace flash::sim
