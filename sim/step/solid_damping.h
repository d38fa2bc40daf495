#pragma once
#include <Eigen/Core>
#include <vector>

#include "sim/law/solid.h"
#include "sim/plan/sheet_plan.h"

namespace flash::sim {

/// F^T F at each point of quadrature of all bodies, in the order of the plan's elements.
std::vector<Eigen::Matrix3d> solid_metrics(const SheetPlan& plan, const data::Points& positions);

/// Potential of the Kelvin-Voigt solid over a step that started at `start_metrics`, as that of the membrane
/// (sim/step/strain_energy.h): with dE = (F^T F - C_0) / 2,
///
///   sum V (mu |dE|^2 + lambda / 2 (tr dE)^2) [J],
///
/// moduli `lame` already times b / h. A solid that turns rigidly feels nothing. Returns the potential and
/// adds its gradient to `gradient`.
double add_solid_damping_gradient(const SheetPlan& plan, const Body& body,
                                  const std::vector<Eigen::Matrix3d>& start_metrics, const SolidLame& lame,
                                  const data::Points& positions, data::Points& gradient);

/// Adds the Hessian of that potential; `positive` leaves out what compression takes away.
void add_solid_damping_hessian(const SheetPlan& plan, const Body& body,
                               const std::vector<Eigen::Matrix3d>& start_metrics, const SolidLame& lame,
                               const data::Points& positions, Curvature curvature,
                               BlockValues<double>& values);

}  // namespace flash::sim
