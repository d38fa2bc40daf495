#include "sysid/infer/held.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

std::vector<std::string> names_of(const std::vector<HeldParameter>& held) {
  std::vector<std::string> names;
  for (const HeldParameter& each : held) names.push_back(each.name);
  return names;
}

TEST(Held, FrictionIsUncertainUnlessItWasSearchedOrMeasured) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_lift(folder)};
  GridSettings grid;
  grid.base.material = short_lift_material();
  grid.base.material.friction = 0.3;
  grid.axes = {parse_axis("bending", "1e-4:4e-4:3:log")};
  grid.fixed = {parse_hold("areal_density=0.2:measured").axis, parse_hold("young=30:measured").axis};
  const std::vector<HeldParameter> held = held_parameters(grid, replays);
  ASSERT_EQ(names_of(held), std::vector<std::string>{"friction"});
  EXPECT_DOUBLE_EQ(held[0].values[0], 0.15);
  EXPECT_DOUBLE_EQ(held[0].values[1], 0.6);
  EXPECT_EQ(candidate_with({2e-4}, grid, "friction", 0.6).material.friction, 0.6);
  EXPECT_EQ(candidate_with({2e-4}, grid, "friction", 0.6).material.bending_rigidity, 2e-4);

  // One value on the command line is an assumption, like the asset's.
  GridSettings one = grid;
  one.axes.push_back(parse_axis("friction", "0.5"));
  EXPECT_DOUBLE_EQ(held_parameters(one, replays)[0].values[1], 1.0);
  GridSettings searched = grid;
  searched.axes.push_back(parse_axis("friction", "0.1:0.5:3"));
  EXPECT_TRUE(held_parameters(searched, replays).empty());
  GridSettings measured = grid;
  measured.fixed.push_back(parse_hold("friction=0.3").axis);
  EXPECT_TRUE(held_parameters(measured, replays).empty());
}

// A soft sheet is moved by its stretching too: which of both stiffnesses is not searched counts as assumed.
TEST(Held, TheOtherStiffnessIsUncertainUnlessItWasMeasured) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_lift(folder)};
  GridSettings grid;
  grid.base.material = short_lift_material();  // 30 N/m, 2e-4 N m
  grid.fixed = {parse_hold("areal_density=0.2:measured").axis, parse_hold("friction=0.3:measured").axis};
  const auto held_beside = [&](const std::vector<std::pair<std::string, std::string>>& axes) {
    GridSettings asked = grid;
    for (const auto& [name, values] : axes) asked.axes.push_back(parse_axis(name, values));
    return held_parameters(asked, replays);
  };
  std::vector<HeldParameter> held = held_beside({{"bending", "1e-4:4e-4:3:log"}});
  ASSERT_EQ(names_of(held), std::vector<std::string>{"young"});
  EXPECT_DOUBLE_EQ(held[0].values[0], 15);
  EXPECT_DOUBLE_EQ(held[0].values[1], 60);
  held = held_beside({{"bending", "1e-4:4e-4:3:log"}, {"young", "50"}});  // assumed on the command line
  EXPECT_DOUBLE_EQ(held[0].values[1], 100);
  held = held_beside({{"young", "10:100:3:log"}});
  ASSERT_EQ(names_of(held), std::vector<std::string>{"bending"});
  EXPECT_DOUBLE_EQ(held[0].values[1], 4e-4);
  EXPECT_TRUE(held_beside({{"bending", "1e-4:4e-4:3:log"}, {"young", "10:100:3:log"}}).empty());
  EXPECT_TRUE(held_beside({{"start_yaw", "-0.1:0.1:3"}}).empty());  // neither is asked for
}

// A factor of E is the same factor of E t.
TEST(Held, AMembraneIsHeldAlikeAsYoungsModulusAndAsStiffness) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_lift(folder)};
  GridSettings stiffness;
  stiffness.base.material = short_lift_material();
  stiffness.axes = {parse_axis("bending", "1e-4:4e-4:3:log")};
  GridSettings modulus = stiffness;
  modulus.base.thickness = 1.0 / 2048;  // [m]; a power of two, so that not even rounding tells them apart
  const std::vector<HeldParameter> as_stiffness = held_parameters(stiffness, replays),
                                   as_modulus = held_parameters(modulus, replays);
  ASSERT_EQ(names_of(as_stiffness), names_of(as_modulus));
  for (std::size_t h = 0; h < as_stiffness.size(); ++h)
    for (const std::size_t side : {0, 1})
      for (const double share : {1.0, 0.5}) {
        const auto candidate = [&](const GridSettings& grid, const HeldParameter& held) {
          return candidate_with({2e-4}, grid, held.name, held.nearer(side, share));
        };
        EXPECT_EQ(candidate(stiffness, as_stiffness[h]).material, candidate(modulus, as_modulus[h]).material)
            << as_stiffness[h].name;
      }
  const auto young = std::find_if(as_modulus.begin(), as_modulus.end(),
                                  [](const HeldParameter& held) { return held.name == "young"; });
  EXPECT_EQ(candidate_with({2e-4}, modulus, "young", young->values[0]).material.membrane_stiffness, 15);
  EXPECT_EQ(candidate_with({2e-4}, modulus, "young", young->values[1]).material.membrane_stiffness, 60);
}

// D of a plate follows E: it is uncertain about what the estimate makes it.
TEST(Held, BendingThatFollowsYoungIsHeldAboutTheEstimate) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_lift(folder)};
  GridSettings grid;
  grid.base.material = short_lift_material();
  grid.base.thickness = 1e-3;
  grid.base.bending_from_thickness = true;
  grid.axes = {parse_axis("young", "1e4:1e6:3:log")};
  const double nu = grid.base.material.poissons_ratio;
  for (const HeldParameter& held : held_parameters(grid, replays, {1e5}))
    if (held.name == "bending") {
      EXPECT_DOUBLE_EQ(held.at, 1e5 * 1e-9 / (12 * (1 - nu * nu)));
    }
}

// Nobody weighed it: known to 10 %, whatever the asset says. A stated deviation takes the place of that, and
// one as large as the value leaves it above zero.
TEST(Held, TheWeightIsUncertainUnlessItWasMeasured) {
  const data::TemporaryFolder folder;
  std::vector<Replay> replays = {short_lift(folder)};
  replays[0].recording.has_table = false;
  GridSettings grid;
  grid.base.material = short_lift_material();
  grid.base.material.areal_density = 0.2;
  grid.axes = {parse_axis("bending", "1e-4:4e-4:3:log")};
  grid.fixed = {parse_hold("young=30:measured").axis};
  const std::vector<HeldParameter> held = held_parameters(grid, replays);
  ASSERT_EQ(names_of(held), std::vector<std::string>{"areal_density"});
  EXPECT_DOUBLE_EQ(held[0].values[0], 0.2 / 1.1);
  EXPECT_DOUBLE_EQ(held[0].values[1], 0.2 * 1.1);
  EXPECT_TRUE(held[0].shared);

  const auto held_as = [&](const std::string& text) {
    const Hold hold = parse_hold(text);
    GridSettings stated = grid;
    (hold.measured ? stated.fixed : stated.axes).push_back(hold.axis);
    if (hold.deviation) stated.deviations[hold.axis.name] = *hold.deviation;
    return held_parameters(stated, replays);
  };
  EXPECT_TRUE(held_as("areal_density=0.2:measured").empty());
  for (const char* text : {"areal_density=0.25+-0.01:measured", "areal_density=0.25+-0.01"}) {
    const std::vector<HeldParameter> stated = held_as(text);
    ASSERT_EQ(names_of(stated), std::vector<std::string>{"areal_density"}) << text;
    EXPECT_DOUBLE_EQ(stated[0].values[0], 0.24) << text;
    EXPECT_DOUBLE_EQ(stated[0].values[1], 0.26) << text;
  }
  EXPECT_DOUBLE_EQ(held_as("areal_density=0.2+-0.2")[0].values[0], 0.1);
  EXPECT_EQ(names_of(held_as("poisson=0.3+-0.05")), (std::vector<std::string>{"poisson", "areal_density"}));
}

TEST(Held, BoundsOfTheRecordingAreThoseOfAnEvenDistribution) {
  const data::TemporaryFolder folder;
  std::vector<Replay> replays = {short_lift(folder)};
  replays[0].recording.has_table = false;
  replays[0].recording.nuisance.start_yaw = 0.2;
  GridSettings grid;
  grid.base.material = short_lift_material();
  grid.axes = {parse_axis("bending", "1e-4:4e-4:3:log")};
  grid.fixed = {parse_hold("areal_density=0.2:measured").axis, parse_hold("young=30:measured").axis};
  const std::vector<HeldParameter> held = held_parameters(grid, replays);
  ASSERT_EQ(names_of(held), std::vector<std::string>{"start_yaw"});
  EXPECT_DOUBLE_EQ(held[0].values[1], 0.2 / std::sqrt(3.0));
  EXPECT_FALSE(held[0].shared);
}

TEST(Held, APinchIsFoldedAboutAsItIsSaid) {
  const data::TemporaryFolder folder;
  std::vector<Replay> replays = {short_lift(folder)};
  replays[0].recording.has_table = false;
  GridSettings grid;
  grid.base.material = short_lift_material();
  grid.axes = {parse_axis("bending", "1e-4:4e-4:3:log")};
  grid.fixed = {parse_hold("areal_density=0.2:measured").axis, parse_hold("young=30:measured").axis};
  EXPECT_TRUE(held_parameters(grid, replays).empty());  // a clamp has no ridge
  data::RecordedGrasp& grasp = replays[0].recording.grasps.at(0);
  grasp.shape = data::GraspShape::pinch;
  grasp.pitch = 0.1;
  const std::vector<HeldParameter> held = held_parameters(grid, replays);
  ASSERT_EQ(names_of(held), (std::vector<std::string>{"grasp_direction", "grasp_pitch"}));
  EXPECT_DOUBLE_EQ(held[0].values[1], 0.2);
  EXPECT_DOUBLE_EQ(held[1].values[1], 0.3);
  EXPECT_FALSE(held[1].shared);  // each trial folds anew
  grid.axes.push_back(parse_axis("grasp_pitch", "-0.5:0.5:3"));
  grasp.direction = {1, 0, 0};
  EXPECT_TRUE(held_parameters(grid, replays).empty());
}

}  // namespace
}  // namespace flash::sysid
