#include "sim/scene/variation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "data/files/error.h"

namespace flash::sim {
namespace {

TEST(Variation, ReadsRangesOfFactors) {
  const std::vector<Variation> read = parse_variations("bending=0.5:2:log,friction=0.2:0.8", "--vary");
  EXPECT_EQ(read, (std::vector<Variation>{{"bending", 0.5, 2, true}, {"friction", 0.2, 0.8, false}}));
  for (const char* wrong : {"",
                            "bending",
                            "bending=",
                            "bending=1",
                            "bending=1:1",
                            "bending=2:1",
                            "bending=0:1",
                            "bending=-1:1",
                            "bending=1:inf",
                            "bending=nan:1",
                            "bending=1:2:3",
                            "bending=1:2:log:log",
                            "bending=1:2:Log",
                            "wool=1:2",
                            "=1:2",
                            "bending=1:2,",
                            ",bending=1:2",
                            "bending=1:2,bending=1:3",
                            "bending=1 :2",
                            "bending = 1:2"})
    EXPECT_THROW(parse_variations(wrong, "--vary"), data::InputError) << wrong;
}

// The points of Halton in bases 2 and 3 from the second on, by hand.
TEST(Variation, SpreadsEnvironmentsEvenlyAndLeavesTheFirst) {
  const std::vector<Variation> variations = {{"friction", 1, 2, false}, {"young", 0.1, 10, true}};
  const double halves[] = {0.25, 0.75, 0.125, 0.625, 0.375},
               thirds[] = {2. / 3, 1. / 9, 4. / 9, 7. / 9, 2. / 9};
  for (std::size_t k = 0; k < 2; ++k) EXPECT_EQ(factor_of(variations, k, 0), 1);
  for (int e = 1; e <= 5; ++e) {
    EXPECT_NEAR(factor_of(variations, 0, e), 1 + halves[e - 1], 1e-15);
    EXPECT_NEAR(std::log10(factor_of(variations, 1, e)), 2 * thirds[e - 1] - 1, 1e-14);
  }
}

TEST(Variation, ScalesWhatItNamesAndNothingElse) {
  Environment environment;
  environment.materials = {{}, {}};
  environment.solids[1] = {};
  environment.obstacles.push_back({.shape = Plane{}, .friction = {0.4, -1}});
  environment.self_contact = SelfContact{};
  const auto factor = [&](const std::vector<Variation>& by) { return factor_of(by, 0, 1); };
  const std::vector<Variation> friction = {{"friction", 1, 2, false}}, young = {{"young", 1, 2, false}},
                               bending = {{"bending", 1, 2, false}}, density = {{"density", 1, 2, false}};
  Environment other = varied(environment, friction, 1);
  EXPECT_DOUBLE_EQ(other.materials[0].friction, 0.3 * factor(friction));
  EXPECT_DOUBLE_EQ(other.solids[1].friction, 0.3 * factor(friction));
  EXPECT_DOUBLE_EQ(other.obstacles[0].friction[0], 0.4 * factor(friction));
  EXPECT_LT(other.obstacles[0].friction[1], 0);  // the material's still
  EXPECT_DOUBLE_EQ(other.self_contact->friction, 0.3 * factor(friction));
  EXPECT_EQ(other.materials[0].bending_rigidity, environment.materials[0].bending_rigidity);
  other = varied(environment, young, 1);
  EXPECT_DOUBLE_EQ(other.materials[0].membrane_stiffness, 100 * factor(young));
  EXPECT_DOUBLE_EQ(other.solids[1].youngs_modulus, 1e5 * factor(young));
  other = varied(environment, density, 1);
  EXPECT_DOUBLE_EQ(other.materials[0].areal_density, 0.2 * factor(density));
  EXPECT_DOUBLE_EQ(other.solids[1].density, 1000 * factor(density));
  other = varied(environment, bending, 1);
  EXPECT_DOUBLE_EQ(other.materials[0].bending_rigidity, 1e-5 * factor(bending));
  EXPECT_EQ(varied(environment, bending, 0).materials, environment.materials);
  EXPECT_TRUE(applies(bending[0], environment));
  environment.materials.pop_back();
  environment.solids = {{0, {}}};
  EXPECT_FALSE(applies(bending[0], environment));
  EXPECT_TRUE(applies(young[0], environment));
}

TEST(Variation, DoesNotApplyToWhatIsZero) {
  Environment environment;
  environment.materials[0].bending_rigidity = 0;
  environment.materials[0].friction = 0;
  environment.obstacles.resize(1);
  const Variation bending{"bending", 0.5, 2, false}, friction{"friction", 0.5, 2, false};
  EXPECT_FALSE(applies(bending, environment));
  EXPECT_FALSE(applies(friction, environment));
  environment.obstacles[0].friction = {0.2};
  EXPECT_TRUE(applies(friction, environment));
  environment.materials[0].bending_rigidity = 1e-5;
  EXPECT_TRUE(applies(bending, environment));
}

}  // namespace
}  // namespace flash::sim
