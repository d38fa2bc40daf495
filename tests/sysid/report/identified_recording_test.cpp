#include "sysid/report/identified_recording.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "sysid/report/export_asset.h"
#include "tests/data/temporary_folder.h"
#include "tests/sysid/summary_fixture.h"

namespace flash::sysid {
namespace {

data::Asset tuned(const Summary& summary) {
  data::Asset base;
  base.mesh = "sheet:0.4x0.4:0.02";
  base.young = 1e5;
  base.thickness = 0.001;
  base.bending_rigidity = 5e-5;
  base.areal_density = 0.25;
  return tuned_asset(base, summary);
}

TEST(IdentifiedRecording, IsWhatTheSearchWeighedAndHowItScored) {
  Summary summary = example_summary();
  SummaryRecording other = summary.recordings[0];
  other.sha256 = std::string(64, 'b');
  other.horizon_s.reset();
  other.score_on_mesh = 0.003;
  other.own_mesh = true;
  summary.recordings[0].mesh = other.mesh = "sheet:0.4x0.4:0.02";
  summary.settings["cell_scale"] = "0.5";
  summary.recordings.push_back(other);
  const data::Asset asset = tuned(summary);
  const auto first = identified_recording(asset, std::string(64, 'a')),
             second = identified_recording(asset, std::string(64, 'b'));
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->horizon_s, 1.9);
  EXPECT_EQ(first->score, 0.0045);
  EXPECT_EQ(first->mesh.mesh, "sheet:0.4x0.4:0.02");
  EXPECT_EQ(first->mesh.cell_scale, 0.5);
  EXPECT_EQ(second->mesh.mesh, "");  // its own
  EXPECT_FALSE(second->horizon_s);   // each has its own
  EXPECT_EQ(second->score, 0.003);
  EXPECT_FALSE(identified_recording(asset, std::string(64, 'c')));
}

TEST(IdentifiedRecording, ScaleOfCellsMayBeANumber) {
  Summary summary = example_summary();
  summary.settings["cell_scale"] = "0.5";
  data::Asset asset = tuned(summary);
  nlohmann::json identification = nlohmann::json::parse(asset.identification);
  identification["solver"]["cell_scale"] = 0.25;
  asset.identification = identification.dump();
  EXPECT_EQ(identified_recording(asset, std::string(64, 'a'))->mesh.cell_scale, 0.25);
  for (const nlohmann::json& wrong : {nlohmann::json(true), nlohmann::json(1e-9)}) {
    identification["solver"]["cell_scale"] = wrong;
    asset.identification = identification.dump();
    EXPECT_NE(
        data::input_error_of([&] { identified_recording(asset, std::string(64, 'a')); }).find("cell_scale"),
        std::string::npos);
  }
}

TEST(IdentifiedRecording, AnotherScoreHasAReason) {
  Summary summary = example_summary();
  const auto line = [&](double score) {
    return unlike_its_score(*identified_recording(tuned(summary), std::string(64, 'a')), score);
  };
  EXPECT_EQ(line(0.0045), "");
  EXPECT_NE(line(0.005).find("the score is 5 mm, and that of the search behind the asset was 4.5 mm"),
            std::string::npos);
  EXPECT_NE(line(0.005).find("its own poisson"), std::string::npos);
  summary.parameters[0].identifiable = Identifiable::yes;
  EXPECT_NE(line(0.005).find("a setting or the version"), std::string::npos);
  summary.recordings[0].score_on_mesh = INFINITY;  // of an earlier program
  summary.score_on_mesh = INFINITY;
  EXPECT_EQ(line(0.005), "");
}

TEST(IdentifiedRecording, AssetsOfOthersAndOfEarlierProgramsLoad) {
  data::Asset asset;
  for (const char* text : {"", "{}", "{\"recordings\": 3}", "{\"recordings\": [null, {\"sha256\": 1}]}"}) {
    asset.identification = text;
    EXPECT_FALSE(identified_recording(asset, "a")) << text;
  }
  asset.identification =
      R"({"recordings": [{"name": "x", "sha256": "a"}], "horizon_s": 2, "score_m": 0.001})";
  EXPECT_EQ(identified_recording(asset, "a")->horizon_s, 2);
  EXPECT_EQ(identified_recording(asset, "a")->score, 0.001);
}

}  // namespace
}  // namespace flash::sysid
