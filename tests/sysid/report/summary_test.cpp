#include "sysid/report/summary.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "data/files/atomic_file.h"
#include "tests/data/temporary_folder.h"
#include "tests/sysid/summary_fixture.h"

namespace flash::sysid {
namespace {

TEST(Summary, ComesBackFromItsFileAsItWas) {
  const data::TemporaryFolder folder;
  const Summary summary = example_summary();
  save_summary(summary, folder / "summary.json");
  const Summary loaded = load_summary(folder / "summary.json");
  EXPECT_EQ(summary_text(loaded), summary_text(summary));
  // The text could lose the same things twice; these it may not.
  ASSERT_EQ(loaded.parameters.size(), 2u);
  EXPECT_EQ(loaded.parameters[0].name, "poisson");  // the order of the axes, not of the alphabet
  EXPECT_EQ(loaded.parameters[1].identifiable, Identifiable::yes);
  EXPECT_EQ(loaded.parameters[0].edge, RangeEdge::low);
  EXPECT_TRUE(std::isinf(loaded.parameters[0].scores[2]));
  EXPECT_EQ(loaded.covariance_log, summary.covariance_log);
  EXPECT_EQ(loaded.recordings[0].horizon_s, 1.9);
  EXPECT_EQ(loaded.recordings[0].horizon_of, "friction");
  EXPECT_EQ(loaded.recordings[0].score_on_mesh, 0.0045);
  EXPECT_EQ(loaded.recordings[0].frames[2].weight, 0);
  EXPECT_EQ(loaded.fixed.at("friction").source, "measured");
}

TEST(Summary, KeepsWhatToRecordNext) {
  const data::TemporaryFolder folder;
  Summary summary = example_summary();
  summary.next_experiments = {
      {"bar_pull", 1.5, {{"poisson", 0.1}, {"bending", 0.2}}, {{"poisson", 0.05}, {"bending", 0.19}}}};
  save_summary(summary, folder / "summary.json");
  const Summary loaded = load_summary(folder / "summary.json");
  ASSERT_EQ(loaded.next_experiments.size(), 1u);
  EXPECT_EQ(loaded.next_experiments[0].name, "bar_pull");
  EXPECT_EQ(loaded.next_experiments[0].bits, 1.5);
  EXPECT_EQ(loaded.next_experiments[0].spread_before.at("bending"), 0.2);
  EXPECT_EQ(loaded.next_experiments[0].spread.at("poisson"), 0.05);
  summary.next_experiments[0].spread.erase("bending");
  save_summary(summary, folder / "summary.json");
  EXPECT_NE(data::input_error_of([&] {
              load_summary(folder / "summary.json");
            }).find("next_experiments.bar_pull.bending"),
            std::string::npos);
}

TEST(Summary, KeepsWhatEachRecordingAsksForAndWhichMisfitsAreLikely) {
  const data::TemporaryFolder folder;
  Summary summary = example_summary();
  summary.agreement = Agreement{12.5, 0.002, {}, {}};
  for (std::size_t r = 0; r < summary.recordings.size(); ++r) {
    summary.agreement->alone.push_back({0.1, 1e-4});
    summary.agreement->spreads.push_back({0.05, 0.2});
  }
  summary.sample_weights = Eigen::VectorXd::LinSpaced(summary.samples.rows(), 0.18, 0.22);
  summary.recordings[0].misfit.draws = {{1e-3, 0.2, 0.1}, {2e-3, 0.4, 0.05}};
  save_summary(summary, folder / "summary.json");
  const Summary loaded = load_summary(folder / "summary.json");
  ASSERT_TRUE(loaded.agreement);
  EXPECT_EQ(loaded.agreement->chance, 0.002);
  EXPECT_EQ(loaded.agreement->alone[0][1], 1e-4);
  EXPECT_EQ(loaded.agreement->spreads[0][0], 0.05);
  EXPECT_EQ(loaded.sample_weights, summary.sample_weights);
  ASSERT_EQ(loaded.recordings[0].misfit.draws.size(), 2u);
  EXPECT_EQ(loaded.recordings[0].misfit.draws[1].reach_time, 0.4);
}

// The factor of a weight that was not measured is applied to what was simulated.
TEST(Summary, AnIntervalMayReachBeyondWhatWasSimulatedByAnErrorOfTheWeightAlone) {
  const data::TemporaryFolder folder;
  Summary summary = example_summary();
  (*summary.parameters[1].interval95)[1] = 1.1 * summary.parameters[1].values.back();
  summary.held.clear();
  save_summary(summary, folder / "summary.json");
  EXPECT_NE(data::input_error_of([&] {
              load_summary(folder / "summary.json");
            }).find("parameters.bending.interval95"),
            std::string::npos);
  summary.held["areal_density"] = {0.18, 0.22};
  save_summary(summary, folder / "summary.json");
  EXPECT_EQ(load_summary(folder / "summary.json").parameters[1].interval95, summary.parameters[1].interval95);
}

// What goes on from a search simulates about its answer alone: the neighbours are those of the search.
TEST(Summary, AnIntervalOfAbruptMotionsMayReachToTheValuesOfAnEarlierSearch) {
  const data::TemporaryFolder folder;
  Summary summary = example_summary();
  summary.held.clear();
  summary.by_points = true;
  (*summary.parameters[1].interval95)[0] = 0.5 * summary.parameters[1].values.front();
  save_summary(summary, folder / "summary.json");
  const Summary loaded = load_summary(folder / "summary.json");
  EXPECT_TRUE(loaded.by_points);
  EXPECT_EQ(loaded.parameters[1].interval95, summary.parameters[1].interval95);
}

TEST(Summary, HasTheFieldsOfItsSchema) {
  const nlohmann::json json = nlohmann::json::parse(summary_text(example_summary()));
  EXPECT_EQ(json["schema"], "flash-sysid-summary/2");
  EXPECT_EQ(json["best"]["parameters"]["bending"], 1e-4);
  EXPECT_EQ(json["best"]["membrane_stiffness"], 30);
  EXPECT_EQ(json["best"]["score"], 0.004);
  EXPECT_EQ(json["best"]["score_on_mesh"], 0.0045);
  EXPECT_EQ(json["parameters"]["bending"]["interval95"][1], 1.5e-4);
  EXPECT_EQ(json["parameters"]["poisson"]["identifiable"], "no");
  EXPECT_EQ(json["parameters"]["poisson"]["edge"], "low");
  EXPECT_TRUE(json["parameters"]["bending"]["edge"].is_null());
  EXPECT_EQ(json["recordings"][0]["frames"][1]["t"], 1.5);
  for (const char* field : {"offset", "time_offset", "score", "noise_m", "misfit_m", "horizon_s"})
    EXPECT_TRUE(json["recordings"][0].contains(field)) << field;
  for (const char* field : {"solver_check", "candidates", "device", "wall_seconds", "warnings", "exit_code"})
    EXPECT_TRUE(json.contains(field)) << field;
}

TEST(Summary, SaysWhichFieldIsWrong) {
  const data::TemporaryFolder folder;
  const std::string text = summary_text(example_summary());
  const auto message_of = [&](const std::string& from, const std::string& to) {
    std::string changed = text;
    changed.replace(changed.find(from), from.size(), to);
    const std::string path = folder.write("summary.json", changed);
    return data::input_error_of([&] { load_summary(path); });
  };
  EXPECT_NE(message_of("summary/2", "summary/3").find("summary.json: schema:"), std::string::npos);
  EXPECT_NE(message_of("\"identifiable\": \"yes\"", "\"identifiable\": \"maybe\"")
                .find("parameters.bending.identifiable"),
            std::string::npos);
  for (const char* version : {"99.0.0", "0.2.0", "", "one"})
    EXPECT_NE(message_of("\"tool_version\": \"" FLASH_VERSION, "\"tool_version\": \"" + std::string(version))
                  .find("summary.json: tool_version:"),
              std::string::npos)
        << version;
  EXPECT_NE(message_of("\"bending\": 0.0001", "\"bending\": -5").find("best.parameters.bending: found -5"),
            std::string::npos);
  EXPECT_NE(message_of("\"score\": 0.004", "\"score\": -5").find("best.score: found -5"), std::string::npos);
  EXPECT_NE(message_of("\"estimate\": 0.00011", "\"estimate\": -1").find("parameters.bending: found -1"),
            std::string::npos);
  EXPECT_NE(message_of("\"estimate\": 0.00011", "\"estimate\": null").find("parameters.bending.estimate"),
            std::string::npos);
  EXPECT_NE(message_of("0.00015", "1e9").find("parameters.bending.interval95"), std::string::npos);
  EXPECT_NE(message_of("\"exit_code\": 0", "\"exit_code\": 7").find("exit_code"), std::string::npos);
  // What a search can find, but did not.
  for (const auto& [from, to] : {std::pair("\"exit_code\": 0", "\"exit_code\": 3"),
                                 std::pair("\"estimate\": 0.00011", "\"estimate\": 0.00012"),
                                 std::pair("\"identifiable\": \"yes\"", "\"identifiable\": \"no\""),
                                 std::pair("\"digest\"", "\"results_digest\"")})
    EXPECT_NE(message_of(from, to).find("digest"), std::string::npos) << to;
  EXPECT_NE(message_of("\"candidates\"", "\"candidate\"").find("did you mean \"candidates\"?"),
            std::string::npos);
}

}  // namespace
}  // namespace flash::sysid
