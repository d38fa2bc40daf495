#include "sysid/infer/nearby.h"

#include <gtest/gtest.h>

#include <map>

#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

std::map<std::string, ReplayCandidate> nearby(const std::vector<double>& values, const GridSettings& grid,
                                              const std::vector<Replay>& replays) {
  std::map<std::string, ReplayCandidate> named;
  for (const NearbyCandidate& each : nearby_candidates(values, grid, replays))
    EXPECT_TRUE(named.emplace(each.parameter, each.candidate).second) << each.parameter;
  return named;
}

// What is known is left as it is; all else is changed, each by itself.
TEST(Nearby, EverySearchedAndEveryUncertainParameterIsChangedByAThousandth) {
  const data::TemporaryFolder folder;
  std::vector<Replay> replays = {short_lift(folder)};
  replays[0].recording.nuisance.start_yaw = 0.3;
  replays[0].recording.nuisance.table_height = 0.01;
  GridSettings grid;
  grid.base.material = short_lift_material();  // 30 N/m, 2e-4 N m
  grid.base.thickness = 1e-3;                  // young is in Pa
  grid.base.material.areal_density = 0.2;
  grid.axes = {parse_axis("bending", "1e-4:4e-4:3:log"), parse_axis("poisson", "0:0.4:3")};
  grid.fixed = {parse_hold("air_drag=0.1:measured").axis};
  add_holds({parse_hold("friction=0.3+-0.02:measured")}, grid);
  const std::vector<double> values = {3e-4, 0};
  const auto changed = nearby(values, grid, replays);
  ASSERT_EQ(changed.size(), 7u);  // bending, poisson, friction, young, areal_density, start_yaw, table_height
  const ReplayCandidate here = candidate_at(values, grid);
  EXPECT_DOUBLE_EQ(changed.at("bending").material.bending_rigidity, 1.001 * 3e-4);
  EXPECT_DOUBLE_EQ(changed.at("young").material.membrane_stiffness, 1.001 * 30);
  EXPECT_DOUBLE_EQ(changed.at("friction").material.friction, 1.001 * 0.3);
  EXPECT_DOUBLE_EQ(changed.at("areal_density").material.areal_density, 1.001 * 0.2);
  // Of what may be zero a thousandth of its width: 0.4, and a bound over sqrt(3) to both sides.
  EXPECT_DOUBLE_EQ(changed.at("poisson").material.poissons_ratio, 0.0004);
  EXPECT_DOUBLE_EQ(changed.at("start_yaw").nuisance.start_yaw, 0.002 * 0.3 / std::sqrt(3.0));
  EXPECT_DOUBLE_EQ(changed.at("table_height").nuisance.table_height, 0.002 * 0.01 / std::sqrt(3.0));
  EXPECT_EQ(changed.at("young").material.bending_rigidity, here.material.bending_rigidity);
  EXPECT_EQ(changed.at("start_yaw").material.membrane_stiffness, here.material.membrane_stiffness);
  for (const auto& [name, candidate] : changed) EXPECT_EQ(candidate.material.air_drag, 0.1) << name;
}

}  // namespace
}  // namespace flash::sysid
