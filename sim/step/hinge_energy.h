#pragma once
#include <limits>
#include <span>
#include <vector>

#include "sim/step/body_law.h"

namespace flash::sim {

/// The hinges of a body among those of all bodies.
std::span<const Hinge> hinges_of(const BodyPlan& place, const std::vector<Hinge>& hinges);

/// Rigidity of hinges, and the curvature at which they begin to yield.
struct HingeStiffness {
  double rigidity;                                                   ///< D [N m]
  double yield_curvature = std::numeric_limits<double>::infinity();  ///< [1/m]
};

/// Where the rest angles of an environment's hinges have come to at the end of a step, and what that took.
struct HingeFlow {
  std::vector<double> rest_angles;  ///< as in State; empty: none has yielded yet
  double lost = 0;                  ///< dissipated by all hinges over the step [J]
};

/// The flow of all bodies that yield, from the state at the start of the step to the end `positions`.
HingeFlow hinge_flow(const SheetPlan& plan, const std::vector<BodyLaw>& laws, const State& start,
                     const data::Points& positions);

/// Adds the gradient of hinges and returns their energy [J]; with what flows, where they yield.
double add_hinge_gradient(std::span<const Hinge> hinges, const HingeStiffness& stiffness,
                          const data::Points& positions, data::Points& gradient);

/// Adds the Gauss-Newton part of the Hessian of a body's hinges, which are those of the plan but for their
/// rest angles.
void add_hinge_hessian(const SheetPlan& plan, const BodyPlan& place, std::span<const Hinge> hinges,
                       const HingeStiffness& stiffness, const data::Points& positions,
                       BlockValues<double>& values);

}  // namespace flash::sim
