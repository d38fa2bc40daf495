#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "sim/law/membrane.h"
#include "sim/law/sheet_stiffness.h"
#include "sim/plan/sheet_plan.h"

namespace flash::sim {

// Energies of a body's triangles that are quadratic in a change of Green's strain, dE = (F^T F - C_0) / 2:
//
//   sum A / 2 dE : C : dE [J],  with the stress F (C : dE).
//
// With C_0 = I this is the membrane of Saint Venant and Kirchhoff, which may be woven. With C_0 at the start
// of a step and C times b / h it is the potential of the Kelvin-Voigt membrane: b times the material's
// stiffness times the rate of strain, and nothing where the sheet turns.

/// F^T F of each triangle of all bodies at `positions`, in the order of the sheet's.
std::vector<Eigen::Matrix2d> triangle_metrics(const SheetPlan& plan, const data::Points& positions);

/// Returns the energy of a body and adds its gradient to `gradient`. `start_metrics`: C_0 of the triangles of
/// all bodies; empty: the rest shape.
double add_strain_gradient(const SheetPlan& plan, const BodyPlan& place,
                           std::span<const Eigen::Matrix2d> start_metrics, const SheetStiffness& stiffness,
                           const data::Points& positions, data::Points& gradient);

/// Adds the Hessian of that energy; `positive` leaves out what compression takes away.
void add_strain_hessian(const SheetPlan& plan, const BodyPlan& place,
                        std::span<const Eigen::Matrix2d> start_metrics, const SheetStiffness& stiffness,
                        const data::Points& positions, Curvature curvature, BlockValues<double>& values);

}  // namespace flash::sim
