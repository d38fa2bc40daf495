#include "sysid/export_asset.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/data/temporary_folder.h"
#include "tests/sysid/summary_fixture.h"

namespace flash::sysid {
namespace {

data::Asset towel() {
  data::Asset asset;
  asset.mesh = "sheet:0.4x0.4:0.02";
  asset.young = 1e5;
  asset.thickness = 0.001;
  asset.bending_rigidity = 5e-5;
  asset.areal_density = 0.25;
  return asset;
}

TEST(ExportAsset, TakesEstimatesWhereKnownAndTheBestCandidateElsewhere) {
  const data::Asset tuned = tuned_asset(towel(), example_summary());
  EXPECT_EQ(tuned.bending_rigidity, 1.1e-4);  // identified: the estimate, not the best grid value 1e-4
  EXPECT_EQ(tuned.poisson, 0.2);              // not identified: the best candidate's
  EXPECT_EQ(tuned.young, 3e4);
  EXPECT_EQ(tuned.areal_density, 0.2);
}

TEST(ExportAsset, RandomizesOverTheIntervalOrAllThatWasSearched) {
  const auto ranges = randomization_ranges(example_summary());
  EXPECT_EQ(ranges.at("bending"), (std::array<double, 2>{8e-5, 1.5e-4}));
  EXPECT_EQ(ranges.at("poisson"), (std::array<double, 2>{0.0, 0.4}));
}

TEST(ExportAsset, IsAnAssetThatLoadsWithItsIdentification) {
  const data::TemporaryFolder folder;
  data::save_asset(tuned_asset(towel(), example_summary()), folder / "tuned.json");
  const data::Asset loaded = data::load_asset(folder / "tuned.json");
  EXPECT_EQ(loaded.bending_rigidity, 1.1e-4);
  const nlohmann::json identification = nlohmann::json::parse(loaded.identification);
  EXPECT_EQ(identification["recordings"][0]["name"], "lift");
  EXPECT_EQ(identification["identifiable"]["poisson"], "no");
  EXPECT_EQ(identification["fixed"]["friction"]["source"], "measured");
  EXPECT_EQ(identification["horizon_s"], 1.9);
  EXPECT_EQ(identification["covariance_log"]["parameters"][1], "bending");
  for (const char* field : {"estimate", "interval95", "score_m", "solver", "tool_version", "randomization"})
    EXPECT_TRUE(identification.contains(field)) << field;
}

// The plate formula goes on ruling D where it ruled before and nobody searched D.
TEST(ExportAsset, LeavesThePlateFormulaInCharge) {
  data::Asset asset = towel();
  asset.bending_rigidity.reset();
  Summary summary = example_summary();
  summary.parameters.pop_back();
  EXPECT_FALSE(tuned_asset(asset, summary).bending_rigidity.has_value());
}

TEST(ExportAsset, RefusesASearchWithoutACandidate) {
  Summary summary = example_summary();
  summary.best.clear();
  EXPECT_THROW(tuned_asset(towel(), summary), data::InputError);
}

}  // namespace
}  // namespace flash::sysid
