#include "sysid/design/plan.h"

#include <gtest/gtest.h>

#include <cmath>

#include "data/mesh/procedural_mesh.h"
#include "sysid/design/virtual_experiment.h"

namespace flash::sysid {
namespace {

data::SheetMaterial towel() {
  data::SheetMaterial material;
  material.membrane_stiffness = 30;
  material.bending_rigidity = 2e-4;
  return material;
}

PlanSettings bending_unknown() {
  PlanSettings settings;
  settings.grid.base.material = towel();
  settings.grid.axes = {{"bending", {2e-5, 2e-3}, true}};
  settings.at = {2e-4};
  return settings;
}

// A uniform distribution's standard deviation is its width over the root of 12.
TEST(Plan, TheRangeAloneIsAUniformDistribution) {
  const std::vector<double> spread =
      spread_of_ranges({{"bending", {1, std::exp(1.0)}, true}, {"poisson", {0, 0.45}, false}});
  EXPECT_DOUBLE_EQ(spread[0], 1 / std::sqrt(12.0));
  EXPECT_DOUBLE_EQ(spread[1], 0.45 / std::sqrt(12.0));
}

// A sheet that is stretched flat on the table has no curvature, whatever its rigidity; a lifted one has.
TEST(Plan, AFlatSheetSaysNothingOfItsBending) {
  const PlanSettings settings = bending_unknown();
  data::Recording sheet;
  sheet.mesh_spec = "sheet:0.2x0.2:0.05:alternating";
  sheet.mesh = data::parse_mesh_spec(sheet.mesh_spec);
  const double before = spread_of_ranges(settings.grid.axes).front();
  const auto after = [&](const char* kind) {
    return plan_experiment(kind, {virtual_experiment(kind, sheet, towel(), {})}, settings).spread[0];
  };
  // 1e-3: its points would move by 10 um where the rigidity is e times as large, which the solver's tolerance
  // stays below.
  EXPECT_NEAR(after("bar_pull"), before, 1e-3 * before);
  EXPECT_LT(after("corner_lift"), 0.5 * before);
}

}  // namespace
}  // namespace flash::sysid
