#include "sysid/report/export_asset.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "sysid/report/next_steps.h"
#include "tests/data/temporary_folder.h"
#include "tests/sysid/summary_fixture.h"

namespace flash::sysid {
namespace {

data::Asset towel() {
  data::Asset asset;
  asset.mesh = "sheet:0.4x0.4:0.02:alternating";
  asset.young = 1e5;
  asset.thickness = 0.001;
  asset.bending_rigidity = 5e-5;
  asset.areal_density = 0.25;
  return asset;
}

TEST(ExportAsset, OfASolidHasItsDensityAndWhatWasTold) {
  data::Asset asset;
  asset.source = "silicone.json";
  asset.mesh = "box:0.1x0.03x0.03:0.015";
  asset.element_type = data::ElementType::tetrahedron;
  asset.element_order = data::ElementOrder::quadratic;
  asset.constitutive = data::Constitutive::tet_neohookean;
  asset.young = 2e5;
  asset.poisson = 0.48;
  asset.mass = 0.09;
  Summary summary = example_summary();
  summary.best = {{"young", 2.6e5},  {"poisson", 0.499}, {"density", 1070.0},
                  {"friction", 0.3}, {"air_drag", 0.0},  {"stiffness_damping", 0.01}};
  summary.settings["object_mesh"] = "box:0.1x0.03x0.03:0.01";
  summary.parameters.resize(2);
  summary.parameters[0].name = "young";
  summary.parameters[0].identifiable = Identifiable::yes;
  summary.parameters[0].estimate = 2.61e5;
  summary.parameters[1].name = "poisson";
  summary.parameters[1].identifiable = Identifiable::no;
  const data::Asset tuned = tuned_asset(asset, summary);
  EXPECT_EQ(tuned.mesh, "box:0.1x0.03x0.03:0.01");
  EXPECT_EQ(tuned.element_order, data::ElementOrder::quadratic);
  EXPECT_EQ(tuned.young, 2.61e5);
  EXPECT_EQ(tuned.poisson, 0.48);  // not told: the asset's
  EXPECT_EQ(tuned.density, 1070);
  EXPECT_FALSE(tuned.mass || tuned.areal_density || tuned.bending_rigidity);
  EXPECT_EQ(tuned.stiffness_damping, 0.01);
}

TEST(ExportAsset, TakesEstimatesWhereKnownAndTheAssetsValueElsewhere) {
  const data::Asset tuned = tuned_asset(towel(), example_summary());
  EXPECT_EQ(tuned.bending_rigidity, 1.1e-4);  // identified: the estimate, not the best grid value 1e-4
  EXPECT_EQ(tuned.poisson, 0.3);              // not identifiable: the asset's, not the best candidate's 0.2
  EXPECT_EQ(tuned.young, 3e4);
  EXPECT_EQ(tuned.areal_density, 0.2);
  const nlohmann::json identification = nlohmann::json::parse(tuned.identification);
  EXPECT_TRUE(identification["estimate"]["poisson"].is_null());
  EXPECT_TRUE(identification["interval95"]["poisson"].is_null());
  EXPECT_EQ(identification["fixed"]["poisson"]["value"], 0.3);
  EXPECT_EQ(identification["fixed"]["poisson"]["source"], "assumed");
  EXPECT_EQ(identification["interval95"]["bending"][0], 8e-5);
  EXPECT_EQ(identification["samples"]["parameters"], (std::vector<std::string>{"poisson", "bending"}));
  EXPECT_EQ(identification["samples"]["values"][1], (std::vector<double>{0.3, 1.2e-4}));
}

// Motion tells stiffnesses as ratios to a weight that nobody measured.
TEST(ExportAsset, DrawsHaveTheWeightThatGoesWithTheirStiffnesses) {
  Summary summary = example_summary();
  summary.sample_weights = Eigen::VectorXd::LinSpaced(summary.samples.rows(), 0.18, 0.22);
  const nlohmann::json samples =
      nlohmann::json::parse(tuned_asset(towel(), summary).identification)["samples"];
  EXPECT_EQ(samples["parameters"], (std::vector<std::string>{"poisson", "bending", "areal_density"}));
  EXPECT_EQ(samples["values"][0][2], 0.18);
}

TEST(ExportAsset, YieldsWhereTheSearchTellsSoAndAsTheAssetDoesElsewhere) {
  Summary summary = example_summary();
  summary.best["yield_curvature"] = 30;
  summary.parameters[0].name = "yield_curvature";
  summary.parameters[0].estimate = 32;
  summary.parameters[0].identifiable = Identifiable::yes;
  data::Asset asset = towel();
  asset.bending_model = data::BendingModel::hinge;
  EXPECT_EQ(tuned_asset(asset, summary).yield_curvature, 32);
  summary.parameters[0].identifiable = Identifiable::no;
  EXPECT_FALSE(tuned_asset(asset, summary).yield_curvature);
  asset.yield_curvature = 50;
  EXPECT_EQ(tuned_asset(asset, summary).yield_curvature, 50);
}

TEST(ExportAsset, AValueThatIsKeptKeepsItsSource) {
  data::Asset asset = towel();
  asset.identification = R"({"fixed": {"poisson": {"value": 0.3, "source": "measured"}}})";
  const auto source = [&] {
    return nlohmann::json::parse(
        tuned_asset(asset, example_summary()).identification)["fixed"]["poisson"]["source"];
  };
  EXPECT_EQ(source(), "measured");
  asset.identification = R"({"identifiable": {"poisson": "yes"}, "fixed": {}})";
  EXPECT_EQ(source(), "identified");
}

// The asset file's sheet is only where the search began.
TEST(ExportAsset, IsOfTheSheetThatWasIdentified) {
  Summary summary = example_summary();
  summary.settings["object_mesh"] = "sheet:0.30x0.24:0.01:alternating";
  summary.parameters.front().name = "areal_density";  // not identifiable: the mass of the asset by this area
  summary.parameters.front().values = {0.1, 0.2, 0.3};
  data::Asset asset = towel();
  asset.areal_density.reset();
  asset.mass = 0.018;
  const data::Asset tuned = tuned_asset(asset, summary);
  EXPECT_EQ(tuned.mesh, "sheet:0.30x0.24:0.01:alternating");
  EXPECT_NEAR(*tuned.areal_density, 0.018 / (0.30 * 0.24), 1e-12);
  std::vector<std::string> notices;
  const data::Asset published = data::express_as(tuned, data::AssetFormat::published, 0.30 * 0.24, notices);
  EXPECT_NEAR(*published.object_mass, 0.018, 1e-12);
}

TEST(ExportAsset, CarriesTheCaveatsOfItsIntervals) {
  Summary summary = example_summary();
  const auto kept = [&] {
    return nlohmann::json::parse(tuned_asset(towel(), summary).identification)["caveats"];
  };
  EXPECT_EQ(kept().size(), 1u);  // the model does not fit
  summary.by_points = true;
  EXPECT_EQ(kept(), caveats(summary));
  EXPECT_EQ(kept().size(), 2u);
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
