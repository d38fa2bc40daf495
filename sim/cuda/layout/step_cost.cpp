#include "sim/cuda/layout/step_cost.h"

namespace flash::sim::cuda {

PartCost operator+(const PartCost& a, const PartCost& b) { return {a.bytes + b.bytes, a.flops + b.flops}; }
PartCost operator*(double times, const PartCost& cost) { return {times * cost.bytes, times * cost.flops}; }

StepCost step_cost(const SheetPlan& plan, const FrontPlan& fronts, const SheetLayout& layout,
                   int factor_number) {
  constexpr double place = 32, force = 24, vector = 12, block = 36;  // bytes of a vertex; of a 3 x 3 block
  constexpr double gradient_flops = 300, hessian_flops = 900, double_precision = 2, block_flops = 18;
  const double vertices = layout.size, triangles = layout.triangle_count, blocks = layout.block_count,
               entries = static_cast<double>(fronts.factor_entries),
               scalar_flops = 24 * static_cast<double>(layout.step_columns.size());
  // Of the exact matrix: the diagonal, and both triangles of what edges couple.
  const double edge_blocks = vertices + 2.0 * static_cast<double>(plan.edge_count);
  StepCost cost;
  cost.evaluation = {(place + force) * vertices,
                     double_precision * (gradient_flops * triangles + scalar_flops)};
  cost.matrix = {place * vertices + block * edge_blocks, double_precision * hessian_flops * triangles};
  cost.preconditioner = {place * vertices + block * blocks, double_precision * hessian_flops * triangles};
  cost.factorization = {block * blocks + factor_number * entries, fronts.factor_flops};
  cost.solve = {2 * factor_number * entries + 2 * vector * vertices, 4 * entries};
  cost.product = {block * edge_blocks + 2 * vector * vertices, block_flops * edge_blocks + scalar_flops};
  return cost;
}

PartCost whole_step(const StepCost& cost, double iterations, double factorizations, double solves) {
  return (iterations + 1) * cost.evaluation + iterations * cost.matrix +
         factorizations * (cost.preconditioner + cost.factorization) + solves * (cost.solve + cost.product);
}

}  // namespace flash::sim::cuda
