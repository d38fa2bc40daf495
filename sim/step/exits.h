#pragma once
#include <vector>

#include "sim/plan/sheet_plan.h"
#include "sim/step/contact_set.h"

namespace flash::sim {

/// Exits to try for a sheet that starts inside obstacles, the fastest first. Each vertex leaves on its own
/// side; then all leave in the direction in which the whole sheet has the shortest way. At last it stays
/// where it is. `inside` is as vertices_inside finds it.
std::vector<WayOut<double>> exits_of(const ContactStep& step, const std::vector<std::vector<int>>& inside);

/// Whether leaving the obstacles has not torn the sheet, which ends the step at `end`. Edges at vertices that
/// started inside must not be strained by more than v sqrt(rho / (E t)), of a solid v sqrt(rho / E), or than
/// they were at the start. A sheet that is released turns that strain into the step's exit speed v.
bool exits_gently(const ContactStep& step, const SheetPlan& plan, const std::vector<std::vector<int>>& inside,
                  const data::Points& end);

}  // namespace flash::sim
