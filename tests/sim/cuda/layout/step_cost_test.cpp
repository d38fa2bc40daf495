#include "sim/cuda/layout/step_cost.h"

#include <gtest/gtest.h>

#include "tests/sim/sheet_scene.h"

namespace flash::sim::cuda {
namespace {

/// A square of two triangles: every number can be counted by hand.
TEST(StepCost, IsWhatTwoTrianglesNeed) {
  const auto plan = make_sheet_plan(small_sheet(1, 0.1));
  ASSERT_EQ(plan->pattern.size, 4);
  const BendingOperator& bending = bending_operator(*plan, data::BendingModel::plate, 0.3);
  const FrontPlan fronts = plan_fronts(plan->pattern, plan->sheet.rest.vertices);
  const StepCost cost = step_cost(*plan, fronts, lay_out(*plan, bending, fronts));
  // Places of four vertices in, forces out; a diagonal block each, two of each of five edges.
  EXPECT_EQ(cost.evaluation.bytes, 4 * (32 + 24));
  EXPECT_EQ(cost.matrix.bytes, 4 * 32 + 36 * (4 + 2 * 5));
  EXPECT_EQ(cost.matrix.flops, 2 * 2 * 900);
  EXPECT_EQ(cost.product.bytes, 36 * 14 + 2 * 4 * 12);
  // All four vertices are in one front: its lower triangle, twice read in half precision.
  EXPECT_EQ(cost.solve.bytes, 2 * 2 * fronts.factor_entries + 2 * 4 * 12);
  EXPECT_EQ(cost.solve.flops, 4 * fronts.factor_entries);
  EXPECT_EQ(cost.factorization.flops, fronts.factor_flops);
}

TEST(StepCost, OfAStepAddsUpItsParts) {
  StepCost cost;
  cost.evaluation = {1, 0};
  cost.matrix = {10, 0};
  cost.preconditioner = {100, 0};
  cost.factorization = {1000, 1};
  cost.solve = {10000, 10};
  cost.product = {100000, 100};
  const PartCost step = whole_step(cost, 3, 2, 5);
  EXPECT_EQ(step.bytes, 4 + 30 + 2 * 1100 + 5 * 110000);
  EXPECT_EQ(step.flops, 2 * 1 + 5 * 110);
}

}  // namespace
}  // namespace flash::sim::cuda
