#pragma once
#include "data/material.h"
#include "sim/law/membrane.h"
#include "sim/plan/sheet_plan.h"

namespace flash::sim {

struct ElasticEnergy {
  double membrane = 0.0;  ///< [J]
  double bending = 0.0;   ///< [J]
};

/// Elastic energy of the sheet at `positions`; adds its gradient to `gradient` (vertices x 3) [N].
ElasticEnergy add_elastic_gradient(const SheetPlan& plan, const BendingOperator& bending,
                                   const data::SheetMaterial& material, const data::Points& positions,
                                   data::Points& gradient);

/// Adds `scale` times the Hessian of the membrane and the Gauss-Newton Hessian of hinges. `positive`: the
/// negative eigenvalues of each triangle are set to zero.
void add_elastic_hessian(const SheetPlan& plan, const BendingOperator& bending,
                         const data::SheetMaterial& material, const data::Points& positions, double scale,
                         Curvature curvature, BlockValues<double>& values);

/// Adds `rigidity` times the stand-in for the Hessian of a quadratic bending model.
void add_bending_stand_in(const BendingOperator& bending, double rigidity, BlockValues<double>& values);

/// y += rigidity * stiffness * x: the Hessian itself of a quadratic bending model, for other models nothing.
void add_bending_product(const BendingOperator& bending, double rigidity, const data::Points& x,
                         data::Points& y);

}  // namespace flash::sim
