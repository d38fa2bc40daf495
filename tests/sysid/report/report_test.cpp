#include "sysid/report/report.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "data/files/error.h"
#include "tests/sysid/summary_fixture.h"

namespace flash::sysid {
namespace {

Overlay example_overlay() {
  Overlay overlay;
  overlay.name = "lift";
  overlay.triangles.resize(1, 3);
  overlay.triangles << 0, 1, 2;
  OverlayFrame frame;
  frame.t = 1.5;
  frame.vertices.resize(3, 3);
  frame.vertices << 0, 0, 0, 0.1, 0, 0, 0, 0.25, 0.01234;
  frame.cloud = data::Points::Constant(10, 3, 0.1);
  frame.score = 0.004;
  overlay.frames = {frame};
  return overlay;
}

// What stands between the tags of the data element, as a browser would cut it.
nlohmann::json data_of(const std::string& html) {
  const std::string open = "<script type=\"application/json\" id=\"data\">";
  const std::size_t begin = html.find(open) + open.size();
  return nlohmann::json::parse(html.substr(begin, html.find("</script>", begin) - begin));
}

TEST(Report, CarriesItsDataAndItsLibraryInside) {
  const std::string html = render_report(example_summary(), example_results(), {example_overlay()}, {});
  const nlohmann::json data = data_of(html);
  EXPECT_EQ(data["parameters"][0]["name"], "poisson");
  EXPECT_EQ(data["parameters"][0]["note"], "no value is excluded </script>");  // does not end the element
  EXPECT_EQ(data["parameters"][1]["unit"], "N m");
  EXPECT_EQ(data["table"]["values"].size(), 9u);
  EXPECT_TRUE(data["table"]["scores"][8].is_null());
  EXPECT_NE(html.find("Plotly, Inc."), std::string::npos);
  EXPECT_NE(html.find("Permission is hereby granted"), std::string::npos);  // the licence travels with it
  EXPECT_GT(html.size(), 2'000'000u);
}

TEST(Report, OpensOffline) {
  // Our own page: what follows the plotting library, and what precedes the data.
  const std::string html = render_report(example_summary(), example_results(), {}, {});
  const std::string head = html.substr(0, html.find("id=\"data\"")),
                    script = html.substr(html.rfind("<script>"));
  for (const std::string& part : {head, script})
    for (const char* loads : {"http://", "https://", "src=", "@import", "fetch(", "<link"})
      EXPECT_EQ(part.find(loads), std::string::npos) << loads;
  EXPECT_EQ(html.find("@PLOTLY@"), std::string::npos);
  EXPECT_EQ(html.find("@DATA@"), std::string::npos);
}

TEST(Report, SaysWhichBoundWhichCandidateEndedAt) {
  GridResults results = example_results();
  for (std::size_t i = 0; i < results.candidates.size(); ++i) {
    results.candidates[i].recordings.resize(1);
    if (i < 3) results.candidates[i].recordings[0].bounds_hit = {"time"};  // scores 8, 7 and 6 mm
  }
  results.candidates[4].recordings[0].bounds_hit = {"offset_x"};  // the best
  const nlohmann::json bounds = data_of(render_report(example_summary(), results, {}, {}))["bounds"];
  ASSERT_EQ(bounds.size(), 2u);
  EXPECT_EQ(bounds[0]["what"], "offset x");
  EXPECT_EQ(bounds[0]["best"], true);
  EXPECT_EQ(bounds[0]["hits"],
            (std::vector<int>{1, 0, 0, 0, 0, 0, 0, 0}));  // in order of score; one diverged
  EXPECT_EQ(bounds[1]["what"], "clock");
  EXPECT_EQ(bounds[1]["best"], false);
  EXPECT_EQ(bounds[1]["hits"], (std::vector<int>{0, 0, 0, 1, 0, 1, 0, 1}));
}

TEST(Report, ShowsTheReplayInTenthsOfAMillimetre) {
  ReportSettings settings;
  settings.max_cloud_points = 4;
  const nlohmann::json replay = data_of(
      render_report(example_summary(), example_results(), {example_overlay()}, settings))["replays"][0];
  EXPECT_EQ(replay["triangles"], nlohmann::json({0, 1, 2}));
  EXPECT_EQ(replay["frames"][0]["mesh"], nlohmann::json({0, 0, 0, 1000, 0, 0, 0, 2500, 123}));
  EXPECT_EQ(replay["frames"][0]["cloud"].size(), 12u);  // thinned to four points
}

TEST(Report, RefusesAMapOfWhatWasNotSearched) {
  ReportSettings settings;
  settings.map_axes = {"bending", "friction"};
  EXPECT_THROW(render_report(example_summary(), example_results(), {}, settings), data::InputError);
}

}  // namespace
}  // namespace flash::sysid
