#include "data/recording/recording_markers.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "data/files/text.h"
#include "data/recording/recording_digest.h"
#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

using Eigen::Vector3d;
using nlohmann::json;

/// A block that is held at x = 0 and tracked by markers, on disk; tests change one thing.
class TrackedSolid : public testing::Test {
 protected:
  TrackedSolid() {
    json_ = json::parse(R"({
      "schema": "flash-recording/1", "name": "block", "kind": "cantilever", "gravity": [0, 0, -9.81],
      "object": {"mesh": "box:0.1x0.02x0.02:0.02", "start": {"T_base_object": [1, 0, 0, 0, 0, 0, 1]}},
      "supports": [{"name": "wall", "select": {"box": {"max": [0, null, null]}}}],
      "loads": [{"select": {"box": {"min": [0.1, null, 0.02]}}, "attached_mass": 0.05}],
      "markers": {"tracks": "tracks.csv", "on_support": ["base"]}})");
    tracks_ = "t,marker,x,y,z\n5,tip,1.1,0.01,0.03\n5,base,1,0,0\n5.5,tip,1.1,0.01,0.02\n";
  }

  Recording load() {
    folder_.write("tracks.csv", tracks_);
    return load_recording(folder_.write("recording.json", json_.dump()));
  }

  /// The message after the path of recording.json, or of another file its name and what follows.
  std::string message() {
    std::string text = input_error_of([&] { load(); });
    const std::string folder = folder_ / "";
    if (text.starts_with(folder)) text = text.substr(folder.size());
    return text.starts_with("recording.json: ") ? text.substr(16) : text;
  }

  TemporaryFolder folder_;
  json json_;
  std::string tracks_;
};

TEST_F(TrackedSolid, AMarkerOnTheSupportThatMovesIsNamed) {
  // `drift` over all samples, evenly, and noise to and fro [mm].
  const auto tracks = [&](int samples, double drift, double noise) {
    tracks_ = "t,marker,x,y,z\n";
    for (int k = 0; k < samples; ++k) {
      const std::string t = format_number(5 + 0.01 * k);
      const double x = 1 + 1e-3 * (drift * k / (samples - 1) + (k % 2 == 0 ? noise : -noise));
      tracks_ += t + ",tip,1.1,0.01,0.03\n" + t + ",base," + format_number(x) + ",0,0\n";
    }
  };
  for (const int samples : {3, 10, 400}) {
    tracks(samples, 9.5, 0);
    const std::string text = message();
    EXPECT_TRUE(text.starts_with("markers.on_support: marker \"base\" moves by ")) << text;
    EXPECT_NE(text.find("expected one that stays where it is, within "), std::string::npos) << text;
  }
  tracks(400, 3, 0.05);
  ASSERT_EQ(load().doubts.size(), 1U);
  EXPECT_TRUE(load().doubts.front().starts_with("markers.on_support: marker \"base\" moves by 2.7"))
      << load().doubts.front();
  for (const double noise : {0.0, 0.3, 1.0}) {
    tracks(400, 0.5, noise);
    EXPECT_TRUE(load().doubts.empty()) << noise;
  }
}

TEST_F(TrackedSolid, RefusesAMarkerFarFromTheObject) {
  tracks_ = "t,marker,x,y,z\n5,tip,1.1,0.01,10.03\n5,base,1,0,0\n5.5,tip,1.1,0.01,0.02\n";
  EXPECT_EQ(message(),
            "markers: marker \"tip\" is 10.01 m from the object at its start, which is 0.1039 m across, "
            "expected at "
            "most half of that: are its tracks in metres and in the base frame, and is object.start right?");
  // A stalk of half the diagonal, 52 mm, is the longest.
  tracks_ = "t,marker,x,y,z\n5,tip,1.1,0.01,0.071\n5,base,1,0,0\n5.5,tip,1.1,0.01,0.02\n";
  EXPECT_EQ(message(), "");
  tracks_ = "t,marker,x,y,z\n5,tip,1.1,0.01,0.073\n5,base,1,0,0\n5.5,tip,1.1,0.01,0.02\n";
  EXPECT_NE(message(), "");
}

TEST_F(TrackedSolid, LoadsTetrahedraSupportsLoadsAndTracks) {
  const Recording recording = load();
  EXPECT_TRUE(recording.is_solid());
  EXPECT_EQ(recording.mesh.vertices.rows(), 6 * 2 * 2);
  EXPECT_EQ(recording.tetrahedra.rows(), 5 * 5);
  EXPECT_EQ(recording.mesh.triangles.rows(), 2 * (2 + 4 * 5));
  ASSERT_EQ(recording.supports.size(), 1u);
  EXPECT_EQ(recording.supports[0].name, "wall");
  EXPECT_EQ(select_vertices(recording, recording.supports[0].select, "s"), (std::vector<int>{0, 6, 12, 18}));
  ASSERT_EQ(recording.loads.size(), 1u);
  EXPECT_EQ(select_vertices(recording, recording.loads[0].select, "l"), (std::vector<int>{17, 23}));
  EXPECT_EQ(recording.loads[0].attached_mass, 0.05);
  EXPECT_EQ(recording.origin, 5);
  ASSERT_EQ(recording.keyframes.size(), 2u);
  EXPECT_EQ(recording.keyframes[1].time, 0.5);

  std::vector<std::string> notices;
  const std::vector<Keyframe> keyframes = load_keyframes(recording, notices);
  ASSERT_EQ(keyframes[0].markers.rows(), 1);  // the other is on the support
  EXPECT_EQ(keyframes[0].markers.row(0), Eigen::RowVector3d(1.1, 0.01, 0.03));
  EXPECT_LT((keyframes[1].marker_places.row(0) - Eigen::RowVector3d(0.1, 0.01, 0.03)).norm(), 1e-15);
}

TEST_F(TrackedSolid, MarkersGiveThePoseOfTheObject) {
  const Eigen::Isometry3d pose =
      Eigen::Translation3d(0.3, -0.2, 0.5) * Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized());
  const std::vector<Vector3d> places = {{0, 0.02, 0.03}, {0.1, 0, 0.02}, {0.05, 0.03, 0}, {0.1, 0.02, 0.01}};
  std::string placed = "marker,x,y,z\n";
  tracks_ = "t,marker,x,y,z\n";
  for (std::size_t k = 0; k < places.size(); ++k) {
    const std::string name = k == 0 ? "base" : "tip" + std::to_string(k);
    const Vector3d seen = pose * places[k];
    placed += name;
    tracks_ += "0," + name;
    for (int axis = 0; axis < 3; ++axis) {
      placed += "," + format_number(places[k][axis]);
      tracks_ += "," + format_number(seen[axis]);
    }
    placed += "\n";
    tracks_ += "\n";
  }
  folder_.write("placed.csv", placed);
  json_["object"].erase("start");
  json_["markers"]["placed"] = "placed.csv";
  const Recording recording = load();
  // Four decimals of a hundredth of a millimetre are written in full: rounding alone.
  EXPECT_LT((recording.base_from_object.matrix() - pose.matrix()).norm(), 1e-12);
  EXPECT_LT((recording.start.row(7).transpose() - pose * recording.mesh.vertices.row(7).transpose()).norm(),
            1e-12);
  EXPECT_FALSE(recording.markers.at[0]);
  EXPECT_LT((*recording.markers.at[2] - places[2]).norm(), 1e-12);
  EXPECT_NE(recording.notices.at(0).find("4 markers give the pose of the object to "), std::string::npos);

  // What hangs already when it is first seen tells no pose by its own markers.
  json_["supports"][0]["from"] = -1;
  EXPECT_NE(message().find("object.start: missing, and 1 markers of"), std::string::npos);
}

TEST_F(TrackedSolid, MarkerSeenLateNeedsItsPlace) {
  json_["supports"][0]["from"] = 4;
  EXPECT_EQ(
      message(),
      "markers.placed: marker \"tip\" is missing, expected its place on the object, as it is not seen when "
      "the recording starts");
  folder_.write("placed.csv", "marker,x,y,z\ntip,0.1,0.01,0.02\n");
  json_["markers"]["placed"] = "placed.csv";
  EXPECT_EQ(*load().markers.at[1], Vector3d(0.1, 0.01, 0.02));
}

TEST_F(TrackedSolid, SaysThatALoadHangsOnWhatIsHeld) {
  EXPECT_TRUE(load().notices.empty());
  json_["loads"][0]["select"] = json::parse(R"({"vertices": [0, 6, 23]})");
  ASSERT_EQ(load().notices.size(), 1u);
  EXPECT_NE(load().notices[0].find("loads[0]: 2 of its 3 vertices are held by supports"), std::string::npos);
}

TEST_F(TrackedSolid, ReadsTablesThatASpreadsheetMarked) {
  tracks_ = "\xef\xbb\xbf" + tracks_;
  EXPECT_EQ(load().keyframes.size(), 2u);
  tracks_ += "5.4,tip,1,0,0\n";
  EXPECT_NE(message().find("tracks.csv: line 5: "), std::string::npos);
}

TEST_F(TrackedSolid, BadTablesAreNamedByLine) {
  const std::string good = tracks_;
  tracks_ = "time,marker,x,y,z\n";
  EXPECT_EQ(message(), "tracks.csv: line 1: expected the header t,marker,x,y,z");
  tracks_ = good + "5.6,tip,1,nan,0\n";
  EXPECT_EQ(message(),
            "tracks.csv: line 5: found \"nan\", expected a finite number; leave the line out where a "
            "marker was not seen");
  tracks_ = good + "5.4,tip,1,0,0\n";
  EXPECT_EQ(message(), "tracks.csv: line 5: found t = 5.4 after 5.5, expected times that do not fall");
  tracks_ = good + "5.5,tip,1,0,0\n";
  EXPECT_EQ(message(), "tracks.csv: line 5: found marker tip twice at t = 5.5, expected once");
  tracks_ = good + "5.5,tip,1,0\n";
  EXPECT_EQ(message(), "tracks.csv: line 5: found \"5.5,tip,1,0\", expected t,marker,x,y,z");
  tracks_ = "t,marker,x,y,z\n";
  EXPECT_EQ(message(), "tracks.csv: line 2: missing, expected at least one marker");
}

TEST_F(TrackedSolid, WrongFieldsAreNamed) {
  const json good = json_;
  const auto with = [&](const char* pointer, const json& value) {
    json_ = good;
    json_[json::json_pointer(pointer)] = value;
    return message();
  };
  EXPECT_EQ(with("/markers/on_support", {"bass"}),
            "markers.on_support: found marker \"bass\", expected one of " + (folder_ / "tracks.csv") +
                " (did you mean \"base\"?)");
  EXPECT_EQ(with("/markers/tracks", "none.csv"), "markers.tracks: found \"none.csv\", expected a file; " +
                                                     (folder_ / "none.csv") + " does not exist");
  EXPECT_EQ(with("/supports/0/select", {{"box", {{"min", {0.2, nullptr, nullptr}}}}}),
            "supports[0].select: no vertex of box:0.1x0.02x0.02:0.02 lies there, expected one at least");
  EXPECT_EQ(with("/supports/0/select", {{"position", {0, 0, 0}}}),
            "supports[0].select: expected corner, vertices or box");
  EXPECT_EQ(with("/loads/0/attached_mass", -1),
            "loads[0].attached_mass: found -1, expected a number above 0");
  EXPECT_EQ(with("/loads/0/select", {{"box", {{"min", {1, 0, 0}}, {"max", {0, 1, 1}}}}}),
            "loads[0].select.box.min: found [1,0,0], expected at most max on every axis");
}

TEST_F(TrackedSolid, IsSavedAndLoadedAlike) {
  const Recording recording = load();
  save_recording(recording, folder_ / "again.json");
  const Recording again = load_recording(folder_ / "again.json");
  EXPECT_EQ(again.tetrahedra, recording.tetrahedra);
  EXPECT_EQ(again.start, recording.start);
  EXPECT_EQ(again.markers.on_support, recording.markers.on_support);
  EXPECT_EQ(again.keyframes.size(), recording.keyframes.size());
  EXPECT_EQ(again.loads[0].attached_mass, 0.05);
  EXPECT_EQ(select_vertices(again, again.supports[0].select, "s"), (std::vector<int>{0, 6, 12, 18}));
  const std::string before = observed_sha256(recording);
  tracks_ += "6,tip,1.1,0.01,0.02\n";
  EXPECT_NE(observed_sha256(load()), before);
}

}  // namespace
}  // namespace flash::data
