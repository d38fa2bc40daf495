#pragma once
#include "data/material.h"
#include "sim/membrane.h"
#include "sim/sheet_plan.h"

namespace flash::sim {

struct ElasticEnergy {
  double membrane = 0.0;  ///< [J]
  double bending = 0.0;   ///< [J]
};

/// Elastic energy of the sheet at `positions`; adds its gradient to `gradient` (vertices x 3) [N].
ElasticEnergy add_elastic_gradient(const SheetPlan& plan, const BendingOperator& bending,
                                   const data::SheetMaterial& material, const data::Points& positions,
                                   data::Points& gradient);

/// Adds `scale` times the elastic Hessian, with the stand-in for the plate's bending. Of the hinge model the
/// Gauss-Newton part. `positive`: the negative eigenvalues of each triangle set to zero.
void add_elastic_hessian(const SheetPlan& plan, const BendingOperator& bending,
                         const data::SheetMaterial& material, const data::Points& positions, double scale,
                         Curvature curvature, BlockValues<double>& values);

/// y += scale * values * x, vertex by vertex.
void add_block_product(const BlockPattern& pattern, const BlockValues<double>& values, double scale,
                       const data::Points& x, data::Points& y);

/// y += D (stiffness - stand-in) x: what the Newton matrix lacks against the bending operator.
void add_bending_correction(const BendingOperator& bending, double bending_rigidity, const data::Points& x,
                            data::Points& y);

}  // namespace flash::sim
