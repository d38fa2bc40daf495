#include "sysid/emulate/parameter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "sysid/emulate/parameter_grid.h"
#include "sysid/replay/motion_store.h"
#include "sysid/report/parameter_label.h"
#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

/// A sheet with a thickness and one without, and a solid.
std::vector<MaterialBase> bases() {
  MaterialBase thick, thin, solid;
  thick.thickness = 5e-4;
  solid.solid = data::SolidMaterial{};
  return {thick, thin, solid};
}

/// A value that is none of any default.
double some_value(const Parameter& parameter, const MaterialBase& base) {
  const auto [low, high] = usual_range(parameter, base);
  return low + 0.37 * (high - low);
}

TEST(Parameter, WhatIsWrittenIntoACandidateIsReadFromIt) {
  constexpr double kRounding = 2 * std::numeric_limits<double>::epsilon();  // E t and E again
  for (const MaterialBase& base : bases())
    for (const Parameter& parameter : known_parameters()) {
      if (!is_of(parameter, base)) continue;
      const double value = some_value(parameter, base);
      const ReplayCandidate candidate = make_candidate(base, {{parameter.name, {value}, false}}, {value});
      EXPECT_NEAR(parameter.get(candidate, base), value, kRounding * std::abs(value)) << parameter.name;
      for (const Parameter& other : known_parameters())
        if (other.name != parameter.name && is_of(other, base)) {
          EXPECT_EQ(other.get(candidate, base), other.get(make_candidate(base, {}, {}), base))
              << parameter.name << " and " << other.name;
        }
    }
}

// Each under a law that it belongs to.
TEST(Parameter, AnotherValueIsAnotherMotion) {
  const data::TemporaryFolder folder;
  Replay replay = short_lift(folder);
  for (data::RecordedGrasp& grasp : replay.recording.grasps) {
    grasp.depth = 0.06;  // more than a cell
  }
  const MaterialBase base{short_lift_material(), {}};
  for (const Parameter& parameter : known_parameters()) {
    if (!is_of(parameter, base)) continue;
    const auto key_at = [&](double value) {
      return motion_key(replay, make_candidate(base, {{parameter.name, {value}, false}}, {value}));
    };
    const double value = some_value(parameter, base);
    const bool of_clamp = parameter.name == "grasp_size" || parameter.name == "grasp_stiffness";
    for (data::RecordedGrasp& grasp : replay.recording.grasps)
      grasp.shape = of_clamp ? data::GraspShape::clamp : data::GraspShape::pinch;
    EXPECT_EQ(key_at(value), key_at(value)) << parameter.name;
    EXPECT_NE(key_at(value), key_at(1.5 * value)) << parameter.name;
  }
}

TEST(Parameter, WhatIsUsualIsAllowed) {
  for (const MaterialBase& base : bases())
    for (const Parameter& parameter : known_parameters()) {
      const auto [low, high] = usual_range(parameter, base);
      EXPECT_LT(low, high) << parameter.name;
      EXPECT_GE(low, parameter.low) << parameter.name;
      EXPECT_LE(high, parameter.high) << parameter.name;
    }
}

TEST(Parameter, YoungIsUsuallyTheSameMembraneWhateverItsUnit) {
  const Parameter& young = parameter_named("young");
  const std::vector<MaterialBase> all = bases();
  for (const std::size_t end : {0, 1})
    EXPECT_DOUBLE_EQ(usual_range(young, all[0])[end] * 5e-4, usual_range(young, all[1])[end]);
  EXPECT_EQ(unit_of(young, all[0]), "Pa");
  EXPECT_EQ(unit_of(young, all[1]), "N/m");
  EXPECT_EQ(unit_of(young, all[2]), "Pa");
}

TEST(Parameter, IsReadByPeopleInItsUnit) {
  const auto plain = [](std::string unit) {
    for (const auto& [power, text] : {std::pair{"²", "^2"}, std::pair{"³", "^3"}})
      if (const std::size_t at = unit.find(power); at != std::string::npos) unit.replace(at, 2, text);
    return unit;
  };
  for (const MaterialBase& base : bases())
    for (const Parameter& parameter : known_parameters()) {
      const ParameterLabel label = parameter_label(parameter.name, base.thickness || base.solid);
      EXPECT_NE(label.symbol, parameter.name);  // an unknown one is its own label
      EXPECT_EQ(plain(label.unit), unit_of(parameter, base)) << parameter.name;
    }
}

}  // namespace
}  // namespace flash::sysid
