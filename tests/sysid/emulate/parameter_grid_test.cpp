#include "sysid/emulate/parameter_grid.h"

#include <gtest/gtest.h>

#include <cmath>

#include "data/files/error.h"

namespace flash::sysid {
namespace {

std::string message_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const data::InputError& error) {
    return error.what();
  }
  return "";
}

const data::SheetMaterial arap = {.constitutive = data::Constitutive::tri_arap};

TEST(ParameterGrid, ReadsRangesListsAndSingleValues) {
  const Axis young = parse_axis("young", "1e3:1e6:4:log");
  ASSERT_EQ(young.values.size(), 4u);
  EXPECT_TRUE(young.logarithmic);
  EXPECT_NEAR(young.values[1], 1e4, 1e-8);
  EXPECT_EQ(young.values[3], 1e6);
  const Axis poisson = parse_axis("poisson", "0:0.45:4");
  EXPECT_FALSE(poisson.logarithmic);
  EXPECT_NEAR(poisson.values[1], 0.15, 1e-15);
  EXPECT_EQ(parse_axis("friction", "0.5,0.2,0.3").values, (std::vector<double>{0.2, 0.3, 0.5}));
  EXPECT_EQ(parse_hold("friction=0.3").axis.values, std::vector<double>{0.3});
}

TEST(ParameterGrid, NamesWhatIsWrong) {
  EXPECT_EQ(message_of([] { parse_axis("yuong", "1"); }),
            "--yuong: unknown parameter (did you mean \"young\"?)");
  EXPECT_NE(message_of([] { parse_axis("young", "1:2:x"); }).find("\"x\" is not a number"),
            std::string::npos);
  EXPECT_NE(message_of([] { parse_axis("bending", "0:1:3:log"); }).find("logarithmic"), std::string::npos);
  EXPECT_NE(message_of([] { parse_axis("young", "5:2:3"); }).find("not below"), std::string::npos);
  const std::vector<Axis> many = {parse_axis("bending", "1e-6:1e-3:100000"),
                                  parse_axis("friction", "0.1:1:100000")};
  EXPECT_NE(message_of([&] {
              check_axes(many, {});
            }).find("--bending, --friction: found 1e+10 candidates, expected at most 1,000,000"),
            std::string::npos);
  EXPECT_NE(message_of([] { parse_axis("poisson", "0.7"); }).find("expected -0.99 to 0.5"),
            std::string::npos);
  EXPECT_NE(message_of([] { parse_hold("friction"); }).find("name=value"), std::string::npos);
}

TEST(ParameterGrid, AWeaveIsSearchedWhereBendingIsThatOfAPlate) {
  const std::vector<Axis> axes = {parse_axis("bending_ratio", "1:5:3")};
  EXPECT_EQ(message_of([&] { check_axes(axes, {}); }), "");
  EXPECT_NE(message_of([&] {
              check_axes(axes, {{.bending_model = data::BendingModel::hinge}, {}});
            }).find("--bending-ratio: found bending_model hinge, expected plate"),
            std::string::npos);
  EXPECT_EQ(make_candidate({}, axes, {3}).material.weave, (data::Weave{.bending_ratio = 3}));
}

TEST(ParameterGrid, AWovenMembraneIsSearchedWhereItsLawMayBeWoven) {
  const std::vector<Axis> axes = {parse_axis("young_ratio", "0.2:1:3"), parse_axis("shear_ratio", "0.1,1")};
  EXPECT_EQ(message_of([&] { check_axes(axes, {{.constitutive = data::Constitutive::tri_stvk}, {}}); }), "");
  EXPECT_NE(message_of([&] {
              check_axes(axes, {});
            }).find("--young-ratio: found constitutive TRI_COROTATED, expected TRI_STVK"),
            std::string::npos);
  EXPECT_EQ(make_candidate({}, axes, {0.4, 0.1}).material.weave,
            (data::Weave{.young_ratio = 0.4, .shear_ratio = 0.1}));
}

TEST(ParameterGrid, AYieldIsSearchedWhereHingesBend) {
  const std::vector<Axis> axes = {parse_axis("yield_curvature", "10:100:3:log")};
  EXPECT_NE(message_of([&] {
              check_axes(axes, {});
            }).find("--yield-curvature: found bending_model plate, expected hinge"),
            std::string::npos);
  const MaterialBase base{{.bending_model = data::BendingModel::hinge}, {}};
  EXPECT_EQ(message_of([&] { check_axes(axes, base); }), "");
  EXPECT_EQ(make_candidate(base, axes, {30}).material.yield_curvature, 30);
}

TEST(ParameterGrid, OptionsAreCalledByTheNamesThatTheyHave) {
  EXPECT_EQ(message_of([] { parse_axis("table_height", "9"); }),
            "--table-height: found 9, expected -0.5 to 0.5 m");
  EXPECT_EQ(message_of([] { parse_axis("start_yaw", "0:x:3"); }).substr(0, 13), "--start-yaw: ");
  EXPECT_EQ(message_of([] { parse_axis("bending", "1e-6:1e-3:3000000"); }),
            "--bending: found the count 3000000, expected a whole number from 1 to 1,000,000");
  EXPECT_EQ(message_of([] { parse_axis("bending", "1e-4,2e-4,1e-4"); }), "--bending: 0.0001 is given twice");
  EXPECT_EQ(message_of([] { parse_hold("yuong=1"); }),
            "--hold yuong: unknown parameter (did you mean \"young\"?)");
  EXPECT_NE(message_of([] { parse_hold("colour=1"); }).find("expected one of young, poisson"),
            std::string::npos);
  EXPECT_EQ(message_of([] { parse_hold("friction=1e300"); }),
            "--hold friction: found 1e+300, expected 0 to 1000");
  EXPECT_EQ(message_of([] { parse_hold("friction=low"); }),
            "--hold friction: found \"low\", expected a number, one with its standard deviation, as "
            "0.31+-0.005, or one with :measured");
}

TEST(ParameterGrid, AHeldValueIsAssumedUnlessItWasMeasured) {
  const Hold assumed = parse_hold("friction=0.3"), measured = parse_hold("friction=0.3:measured");
  EXPECT_EQ(assumed.axis.values, std::vector<double>{0.3});
  EXPECT_EQ(measured.axis.values, std::vector<double>{0.3});
  EXPECT_FALSE(assumed.measured);
  EXPECT_TRUE(measured.measured);
  EXPECT_FALSE(measured.deviation.has_value());
  const Hold near = parse_hold("friction=0.3+-0.02:measured"), about = parse_hold("start_yaw=-0.1+-1e-2");
  EXPECT_EQ(near.axis.values, std::vector<double>{0.3});
  EXPECT_TRUE(near.measured);
  EXPECT_EQ(near.deviation, 0.02);
  EXPECT_EQ(about.axis.values, std::vector<double>{-0.1});
  EXPECT_FALSE(about.measured);
  EXPECT_EQ(about.deviation, 0.01);
  for (const char* none : {"0", "-1", "wide", ""})
    EXPECT_EQ(message_of([&] { parse_hold(std::string("friction=0.3+-") + none); }),
              std::string("--hold friction: found \"") + none +
                  "\", expected a standard deviation above 0, as 0.3+-0.02");
  EXPECT_NE(message_of([] { parse_hold("friction=0.3:weighed"); }).find("found \"0.3:weighed\""),
            std::string::npos);
}

TEST(ParameterGrid, ParametersOfAPinchNeedAPinch) {
  Replay clamped;
  clamped.recording.grasps.resize(1);
  const std::vector<Axis> depth = {parse_axis("grasp_depth", "0.01:0.03:2")};
  EXPECT_NE(message_of([&] { check_grasp_axes(depth, {clamped}); }).find("--grasp-depth: acts on a grasp"),
            std::string::npos);
  Replay pinched = clamped;
  pinched.settings.grasp_shape = data::GraspShape::pinch;
  EXPECT_EQ(message_of([&] { check_grasp_axes(depth, {clamped, pinched}); }), "");
  EXPECT_EQ(message_of([&] { check_grasp_axes({parse_axis("start_yaw", "0:1:2")}, {clamped}); }), "");
}

TEST(ParameterGrid, RefusesYoungAndPoissonTogetherUnderArap) {
  const std::vector<Axis> axes = {parse_axis("young", "1e3:1e6:4:log"), parse_axis("poisson", "0:0.4:3")};
  EXPECT_NE(message_of([&] { check_axes(axes, {arap, {}}); }).find("E / (1 + nu)"), std::string::npos);
  EXPECT_EQ(message_of([&] { check_axes(axes, {}); }), "");
  EXPECT_EQ(message_of([&] { check_axes({axes[0], parse_hold("poisson=0.3").axis}, {arap, {}}); }), "");
  EXPECT_NE(message_of([&] { check_axes({axes[0], axes[0]}, {arap, {}}); }).find("twice"), std::string::npos);
}

TEST(ParameterGrid, SolidsAndSheetsHaveTheirOwnParameters) {
  MaterialBase solid;
  solid.solid = data::SolidMaterial{};
  const auto message = [](const char* name, const char* values, const MaterialBase& base) {
    return message_of([&] { check_axes({parse_axis(name, values)}, base); });
  };
  for (const char* name : {"young", "density", "friction", "air_drag", "stiffness_damping"})
    EXPECT_EQ(message(name, "1:2:2", solid), "") << name;
  EXPECT_EQ(message("bending", "1:2:2", solid), "--bending: found a solid, expected a sheet");
  EXPECT_EQ(message("areal_density", "1:2:2", solid),
            "--areal-density: found a solid, expected a sheet; a solid has --density");
  EXPECT_EQ(message("poisson", "0.3:0.5:2", solid), "--poisson: found 0.5, expected below 0.5 for a solid");
  EXPECT_EQ(message("density", "1:2:2", {}),
            "--density: found a sheet, expected a solid; a sheet has --areal-density");
  const std::vector<Axis> axes = {parse_axis("young", "2e5"), parse_axis("poisson", "0.4"),
                                  parse_axis("density", "900"), parse_axis("stiffness_damping", "0.01")};
  const ReplayCandidate candidate = make_candidate(solid, axes, {2e5, 0.4, 900, 0.01});
  data::SolidMaterial expected;
  expected.youngs_modulus = 2e5;
  expected.poissons_ratio = 0.4;
  expected.density = 900;
  expected.stiffness_damping = 0.01;
  EXPECT_EQ(candidate.solid, expected);
  EXPECT_FALSE(make_candidate({}, {}, {}).solid);
}

TEST(ParameterGrid, ProductHoldsEveryCombinationOnceLastAxisFastest) {
  const auto grid = cartesian_product({{"young", {1, 2}}, {"friction", {0.1, 0.2, 0.3}}});
  ASSERT_EQ(grid.size(), 6u);
  EXPECT_EQ(grid[1], (std::vector<double>{1, 0.2}));
  EXPECT_EQ(grid[5], (std::vector<double>{2, 0.3}));
  EXPECT_EQ(cartesian_product({}).size(), 1u);
}

TEST(ParameterGrid, YoungIsTimesThicknessAndBendingFollowsThePlateFormulaUnlessGiven) {
  MaterialBase base;
  base.thickness = 1e-3;
  base.bending_from_thickness = true;
  const std::vector<Axis> axes = {parse_axis("young", "2e5"), parse_axis("poisson", "0.5")};
  const data::SheetMaterial plate = make_candidate(base, axes, {2e5, 0.5}).material;
  EXPECT_DOUBLE_EQ(plate.membrane_stiffness, 200);
  EXPECT_DOUBLE_EQ(plate.bending_rigidity, 2e5 * 1e-9 / (12 * 0.75));
  EXPECT_DOUBLE_EQ(
      make_candidate(base, {axes[0], parse_axis("bending", "3e-5")}, {2e5, 3e-5}).material.bending_rigidity,
      3e-5);
  EXPECT_DOUBLE_EQ(make_candidate({}, axes, {2e5, 0.5}).material.membrane_stiffness, 2e5);
}

}  // namespace
}  // namespace flash::sysid
