#include "sysid/design/usual_ranges.h"

#include <gtest/gtest.h>

namespace flash::sysid {
namespace {

MaterialBase towel() {
  MaterialBase base;
  base.material.membrane_stiffness = 30;
  base.material.poissons_ratio = 0.3;
  base.material.bending_rigidity = 2e-4;
  base.material.friction = 0.9;
  base.thickness = 1e-3;
  return base;
}

TEST(UsualRanges, StiffnessesAreAboutThoseOfTheAsset) {
  const std::vector<Axis> axes = usual_ranges(towel());
  ASSERT_EQ(axes.size(), 4u);
  EXPECT_EQ(axes[0].name, "young");  // E = 30 N/m / 1 mm
  EXPECT_DOUBLE_EQ(axes[0].values.front(), 6e3);
  EXPECT_DOUBLE_EQ(axes[0].values.back(), 1.5e5);
  EXPECT_EQ(axes[2].name, "bending");
  EXPECT_DOUBLE_EQ(axes[2].values.front(), 2e-5);
  EXPECT_DOUBLE_EQ(axes[2].values.back(), 2e-3);
}

TEST(UsualRanges, BendingFollowsTheThicknessWhereTheAssetSaysNoMore) {
  MaterialBase base = towel();
  base.bending_from_thickness = true;
  const double rigidity = 3e4 * 1e-9 / (12 * (1 - 0.09));  // E t^3 / (12 (1 - nu^2))
  EXPECT_DOUBLE_EQ(usual_ranges(base)[2].values.back(), 10 * rigidity);
}

TEST(UsualRanges, ValuesOutsideAreTheNearestEnd) {
  const MaterialBase base = towel();
  const std::vector<double> values = values_in_range(base, usual_ranges(base));
  EXPECT_DOUBLE_EQ(values[0], 3e4);
  EXPECT_EQ(values[1], 0.3);
  EXPECT_EQ(values[2], 2e-4);
  EXPECT_EQ(values[3], 0.6);
  EXPECT_EQ(values_in_range(base, {{"start_yaw", {-0.2, 0.2}, false}}).front(), 0);
}

}  // namespace
}  // namespace flash::sysid
