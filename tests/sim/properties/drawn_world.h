#pragma once
#include <vector>

#include "sim/newton/solver.h"
#include "tests/drawn_numbers.h"

namespace flash::sim {

// What properties are checked on, drawn by rapidcheck inside of a property: one that fails is made smaller.

/// 0 to count - 1 in any order.
std::vector<int> draw_order(int count);

/// Nine to about sixty vertices, flat: rectangles of every pattern, irregular ones, discs.
Sheet draw_sheet();

/// Every membrane and bending, over four decades of stiffness.
data::SheetMaterial draw_material();

/// Turned, dented by a few percent of a cell, moving, spinning and shaking; nothing holds it.
Environment draw_flight(const Sheet& sheet);

/// Such a flight above one to three planes, boxes, cylinders and capsules, which it does not touch yet; boxes
/// and capsules may move.
Environment draw_fall(const Sheet& sheet);

/// Vertices about one of the sheet's, carried evenly.
Hold draw_grasp(Environment& environment);

/// A fall with up to two grasps, a support and a load.
Environment draw_world(const Sheet& sheet);

Eigen::VectorXd masses_of(const Sheet& sheet, const data::SheetMaterial& material);  ///< [kg]

/// Largest sum over vertices of what the step left unbalanced: |sum r| <= sqrt(n) |r|, and rounding [N].
double unbalanced_sum(const Environment& environment, const Eigen::VectorXd& mass, const StepReport& report);

}  // namespace flash::sim
