#pragma once
#include <vector>

#include "data/asset/material.h"
#include "sim/plan/sheet_plan.h"
#include "sim/scene/environment.h"

namespace flash::sim {

/// Throws where environments cannot be stepped together over a plan, and names the first such: a
/// std::invalid_argument where positions, velocities or bristles are not those of its vertices and of the
/// obstacles, where the environments have not as many holds, where solids are not those of the plan, or where
/// a hold or an obstacle names a frame that its schedule has not; data::InputError where its materials are
/// none that the plan can have, as body_laws says, and as check_stiffness does.
void check_environments(const SheetPlan& plan, const std::vector<Environment>& environments);

/// Throws data::InputError where a material is not one: numbers that are not finite or of the wrong sign.
void check_material(const data::SheetMaterial& material);
void check_material(const data::SolidMaterial& material);

}  // namespace flash::sim
