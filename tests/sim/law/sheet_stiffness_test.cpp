#include "sim/law/sheet_stiffness.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "data/files/error.h"
#include "sim/law/membrane.h"

namespace flash::sim {
namespace {

constexpr double degree = M_PI / 180;

TEST(SheetStiffness, OfAnIsotropicSheetIsThatOfLame) {
  const SheetLame lame = sheet_lame(120, 0.3);
  const Eigen::Matrix3d c = SheetStiffness({.membrane_stiffness = 120}).in({0.6, 0.8});
  EXPECT_NEAR(c(0, 0), 2 * lame.mu + lame.lambda, 1e-12);
  EXPECT_NEAR(c(0, 1), lame.lambda, 1e-12);
  EXPECT_NEAR(c(2, 2), lame.mu, 1e-12);
  EXPECT_EQ(SheetStiffness({.constitutive = data::Constitutive::tri_arap}).in({1, 0})(0, 1), 0);
}

/// 1 / E = c^4 / E_1 + s^4 / E_2 + (1 / G - 2 nu_12 / E_1) c^2 s^2 at an angle to the warp (Lekhnitskii
/// 1968).
TEST(SheetStiffness, OfAWovenSheetPulledAtAnAngleIsLekhnitskiis) {
  const data::Weave weave{.warp_direction = 20 * degree, .young_ratio = 0.4, .shear_ratio = 0.05};
  const data::SheetMaterial material{.membrane_stiffness = 500, .poissons_ratio = 0.25, .weave = weave};
  const double e1 = 500, e2 = 200, g = 0.05 * std::sqrt(e1 * e2) / (2 * 1.25), nu12 = 0.25 / std::sqrt(0.4);
  for (const double angle : {0.0, 20.0, 65.0, 110.0, 155.0}) {
    // The first axis is at `angle` from the base frame's x, which is at -angle in these axes.
    const Eigen::Matrix3d compliance =
        SheetStiffness(material).in({std::cos(angle * degree), -std::sin(angle * degree)}).inverse();
    const double c = std::cos(angle * degree - weave.warp_direction),
                 s = std::sin(angle * degree - weave.warp_direction);
    const double expected =
        std::pow(c, 4) / e1 + std::pow(s, 4) / e2 + (1 / g - 2 * nu12 / e1) * c * c * s * s;
    EXPECT_NEAR(compliance(0, 0), expected, 1e-12 * expected) << angle;
  }
}

TEST(SheetStiffness, RefusesWhatIsNoMaterial) {
  EXPECT_THROW(SheetStiffness({.membrane_stiffness = 0}), data::InputError);
  EXPECT_THROW(SheetStiffness({.poissons_ratio = 1}), data::InputError);
}

}  // namespace
}  // namespace flash::sim
