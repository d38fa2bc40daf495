#pragma once
#include <span>

#include "sim/law/solid.h"
#include "sim/plan/sheet_plan.h"

namespace flash::sim {

/// The elements of a solid body.
std::span<const SolidElement> elements_of(const SheetPlan& plan, const Body& body);

/// Energy of a solid body [J]; adds its gradient [N].
double add_solid_gradient(const SheetPlan& plan, const Body& body, const Solid& solid,
                          const data::Points& positions, data::Points& gradient);

/// Adds `scale` times the Hessian of that energy; `positive`: the negative eigenvalues of each tetrahedron
/// are set to zero.
void add_solid_hessian(const SheetPlan& plan, const Body& body, const Solid& solid,
                       const data::Points& positions, double scale, Curvature curvature,
                       BlockValues<double>& values);

}  // namespace flash::sim
