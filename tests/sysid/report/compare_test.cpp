#include "sysid/report/compare.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "data/files/atomic_file.h"
#include "sysid/report/residuals_file.h"
#include "tests/data/temporary_folder.h"

namespace flash::sysid {
namespace {

LeftResiduals residuals(double offset) {
  LeftResiduals recording;
  recording.rows.times = {1, 1.5, 2};
  recording.rows.places.resize(60, 2);
  recording.rows.weights = Eigen::VectorXd::Ones(60);
  recording.left.resize(60);
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 1e-3);
  for (int i = 0; i < 60; ++i) {
    recording.rows.keyframe.push_back(i / 20);
    recording.rows.channel.push_back(0);
    recording.rows.places.row(i) << 0.01 * (i % 20), 0.01 * (i % 7);
    recording.left[i] = noise(random) + offset * std::sin(0.3 * (i % 20));
  }
  return recording;
}

FinishedSearch search(const std::string& name, const std::string& shape, double offset) {
  FinishedSearch finished{name, {}, {residuals(offset)}};
  finished.summary.best_score = 1e-3 + offset;
  finished.summary.settings = {{"grasp_shape", shape}, {"distance", "mean"}, {"observed", "cloud"}};
  finished.summary.recordings.resize(1);
  finished.summary.recordings[0].name = "lift";
  finished.summary.recordings[0].sha256 = "0123";
  finished.summary.recordings[0].spread = 1e-3;
  finished.summary.open_information = {1e-2};
  return finished;
}

TEST(Compare, TheModelThatMissesLessIsLikelierAndWhatDiffersIsNamed) {
  const std::vector<ComparedSearch> compared = compare({search("a", "clamp", 4e-3), search("b", "pinch", 0)});
  EXPECT_EQ(compared[1].excess, 0);
  EXPECT_GT(compared[0].excess, 1);
  EXPECT_GT(compared[1].probability, compared[0].probability);
  EXPECT_NEAR(compared[0].probability + compared[1].probability, 1, 1e-12);
  EXPECT_EQ(compared[0].differs, (std::map<std::string, std::string>{{"grasp_shape", "clamp"}}));
  EXPECT_EQ(compared[0].occupied, compared[1].occupied);
}

TEST(Compare, ModelsThatLeaveTheSameAreAsLikely) {
  const std::vector<ComparedSearch> compared = compare({search("a", "clamp", 0), search("b", "pinch", 0)});
  EXPECT_DOUBLE_EQ(compared[0].probability, 0.5);
}

TEST(Compare, AParameterThatTellsNothingMoreMakesAModelNoLikelier) {
  FinishedSearch more = search("b", "clamp", 0);
  more.summary.open_information.push_back(1e-2);
  const std::vector<ComparedSearch> compared = compare({search("a", "clamp", 0), more});
  EXPECT_NEAR(compared[1].occupied - compared[0].occupied, -0.5 * std::log(1 + 1e4), 1e-9);
  EXPECT_LT(compared[1].probability, 0.05);
}

TEST(Compare, RecordingsMayBeNamedInAnotherOrder) {
  FinishedSearch both = search("a", "clamp", 0);
  both.summary.recordings.push_back(both.summary.recordings[0]);
  both.summary.recordings[1].sha256 = "4567";
  both.residuals.push_back(residuals(2e-3));
  FinishedSearch turned = both;
  turned.name = "b";
  std::swap(turned.summary.recordings[0], turned.summary.recordings[1]);
  std::swap(turned.residuals[0], turned.residuals[1]);
  EXPECT_DOUBLE_EQ(compare({both, turned})[1].probability, 0.5);
}

TEST(Compare, NamesWhatWasHeld) {
  FinishedSearch held = search("b", "clamp", 0);
  held.summary.fixed["friction"] = {0.3, "measured"};
  const std::vector<ComparedSearch> compared = compare({search("a", "clamp", 0), held});
  EXPECT_EQ(compared[1].differs, (std::map<std::string, std::string>{{"friction", "0.3, measured"}}));
  EXPECT_EQ(compared[0].differs, (std::map<std::string, std::string>{{"friction", "-"}}));
}

TEST(Compare, RefusesOtherObservationsByName) {
  const FinishedSearch first = search("a", "clamp", 0);
  FinishedSearch other = search("b", "pinch", 0);
  other.summary.recordings[0].sha256 = "4567";
  EXPECT_EQ(data::input_error_of([&] {
              compare({first, other});
            }),
            "b: found other recordings than in a, expected searches of the same");
  other = search("b", "pinch", 0);
  other.summary.settings["distance"] = "Huber, 20 mm";
  EXPECT_EQ(data::input_error_of([&] {
              compare({first, other});
            }),
            "b: settings.distance: found \"Huber, 20 mm\", expected \"mean\" as in a");
  other = search("b", "pinch", 0);
  other.residuals[0].rows.times.back() = 1.75;
  EXPECT_EQ(
      data::input_error_of([&] {
        compare({first, other});
      }),
      "b: lift: found 60 observations from 1 to 1.75 s, expected 60 observations from 1 to 2 s as in a: "
      "search all with --no-horizon, or with one --from and --until");
}

TEST(ResidualsFile, ComesBackAsItWas) {
  const data::TemporaryFolder folder;
  const std::vector<LeftResiduals> written = {residuals(0), residuals(2e-3)};
  const std::string text = residuals_text(written), path = folder / "residuals.csv";
  data::write_atomically(path, text);
  const std::vector<LeftResiduals> read = load_residuals(path, residuals_digest(text), {1.5, 0});
  ASSERT_EQ(read.size(), 2u);
  for (std::size_t r = 0; r < 2; ++r) {
    EXPECT_EQ(read[r].left, written[r].left);
    EXPECT_EQ(read[r].rows.times, written[r].rows.times);
    EXPECT_EQ(read[r].rows.keyframe, written[r].rows.keyframe);
    EXPECT_EQ(read[r].rows.channel, written[r].rows.channel);
    EXPECT_EQ(read[r].rows.places, written[r].rows.places);
    EXPECT_EQ(read[r].rows.weights, written[r].rows.weights);
  }
  EXPECT_EQ(read[0].error_cost, 1.5);
}

TEST(ResidualsFile, RefusesWhatIsNotOfTheSearchAndWhatCannotBe) {
  const data::TemporaryFolder folder;
  const std::string path = folder / "residuals.csv", text = residuals_text({residuals(0)});
  data::write_atomically(path, text);
  const auto error = [&](const std::string& digest, const std::vector<double>& costs) {
    return data::input_error_of([&] { load_residuals(path, digest, costs); });
  };
  EXPECT_NE(error("0123456789abcdef", {0}).find("of summary.json beside it"), std::string::npos);
  EXPECT_NE(error(residuals_digest(text), {0, 0}).find("no observation of recording 1"), std::string::npos);
  EXPECT_NE(error(residuals_digest(text), {}).find("residuals.csv:2: recording"), std::string::npos);
  std::string back = text;
  back.replace(back.rfind("\n0,2,") + 3, 1, "1");
  data::write_atomically(path, back);
  EXPECT_NE(error(residuals_digest(back), {0}).find("times that do not decrease"), std::string::npos);
}

}  // namespace
}  // namespace flash::sysid
