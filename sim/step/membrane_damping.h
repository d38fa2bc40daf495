#pragma once
#include <Eigen/Core>
#include <vector>

#include "sim/law/membrane.h"
#include "sim/plan/sheet_plan.h"

namespace flash::sim {

/// F^T F of each triangle of all bodies at `positions`, in the order of the plan's groups.
std::vector<Eigen::Matrix2d> triangle_metrics(const SheetPlan& plan, const data::Points& positions);

/// Potential of the Kelvin-Voigt membrane of a body over a step that started at `start_metrics`: with the
/// change of Green's strain, dE = (F^T F - C_0) / 2,
///
///   sum A (mu |dE|^2 + lambda / 2 (tr dE)^2) [J],
///
/// moduli `lame` already times b / h. Its stress is F (2 mu dE + lambda tr(dE) I): b times the material's
/// stiffness times the rate of strain, and nothing where the sheet turns. Returns the potential and adds its
/// gradient to `gradient`.
double add_membrane_damping_gradient(const SheetPlan& plan, const BodyPlan& place,
                                     const std::vector<Eigen::Matrix2d>& start_metrics, const SheetLame& lame,
                                     const data::Points& positions, data::Points& gradient);

/// Adds the Hessian of that potential; `positive` leaves out what compression takes away.
void add_membrane_damping_hessian(const SheetPlan& plan, const BodyPlan& place,
                                  const std::vector<Eigen::Matrix2d>& start_metrics, const SheetLame& lame,
                                  const data::Points& positions, Curvature curvature,
                                  BlockValues<double>& values);

}  // namespace flash::sim
