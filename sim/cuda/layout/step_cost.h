#pragma once
#include "sim/cuda/layout/front_plan.h"
#include "sim/cuda/layout/sheet_layout.h"

namespace flash::sim::cuda {

/// The least that one call of a part of a step moves and computes for an environment of a quadratic bending
/// model. What environments share is free. Flops of a triangle are counted in its formulas; those in double
/// precision count twice.
struct PartCost {
  double bytes = 0, flops = 0;
};

PartCost operator+(const PartCost& a, const PartCost& b);
PartCost operator*(double times, const PartCost& cost);

/// Of each part, the factor in numbers of `factor_number` bytes.
struct StepCost {
  PartCost evaluation;      ///< energies and gradients
  PartCost matrix;          ///< exact
  PartCost preconditioner;  ///< the positive matrix that is factorized
  PartCost factorization;   ///< with the inverses of its fronts
  PartCost solve;
  PartCost product;
};
StepCost step_cost(const SheetPlan& plan, const FrontPlan& fronts, const SheetLayout& layout,
                   int factor_number = 2);

/// Of a step with so many Newton iterations, factorizations and solves.
PartCost whole_step(const StepCost& cost, double iterations, double factorizations, double solves);

}  // namespace flash::sim::cuda
