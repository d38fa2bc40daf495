#pragma once
#include <vector>

#include "sim/plan/sheet_plan.h"

namespace flash::sim {

/// Adds the gradient of hinges with rigidity D [N m] and returns their energy [J].
double add_hinge_gradient(const std::vector<Hinge>& hinges, double rigidity, const data::Points& positions,
                          data::Points& gradient);

/// Adds the Gauss-Newton part of the Hessian of the plan's hinges, with these rest angles.
void add_hinge_hessian(const SheetPlan& plan, const std::vector<Hinge>& hinges, double rigidity,
                       const data::Points& positions, BlockValues<double>& values);

}  // namespace flash::sim
