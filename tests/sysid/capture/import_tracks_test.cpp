#include "sysid/capture/import_tracks.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "data/files/atomic_file.h"
#include "tests/data/temporary_folder.h"

namespace flash::sysid {
namespace {

class TrackImport : public testing::Test {
 protected:
  TrackImport() {
    std::string tracks = "t,marker,x,y,z\n";
    for (const char* time : {"0", "0.01", "0.02", "0.03", "0.04"})
      tracks += std::string(time) + ",base,0,0,0\n" + time + ",tip,0.1,0,0.02\n";
    settings_.tracks = folder_.write("raw.csv", tracks);
    settings_.on_support = {"base"};
    settings_.clamp.max.x() = 0;
    settings_.gravity = {0, 9.81, 0};
    settings_.mesh_spec = "box:0.1x0.02x0.02:0.02";
    settings_.out = folder_ / "beam";
  }

  data::TemporaryFolder folder_;
  TrackImportSettings settings_;
};

TEST_F(TrackImport, WritesARecordingThatReadsBack) {
  const data::Recording recording = import_tracks(settings_);
  EXPECT_EQ(recording.name, "beam");
  EXPECT_EQ(recording.kind, "cantilever");
  EXPECT_EQ(recording.gravity, Eigen::Vector3d(0, 9.81, 0));
  EXPECT_EQ(recording.keyframes.size(), 5u);
  EXPECT_EQ(data::select_vertices(recording, recording.supports.at(0).select, "supports"),
            (std::vector<int>{0, 6, 12, 18}));
  EXPECT_FALSE(recording.markers.at[0]);
  EXPECT_EQ(*recording.markers.at[1], Eigen::Vector3d(0.1, 0, 0.02));
}

TEST_F(TrackImport, KeepsOneOfSoManyTimes) {
  settings_.every = 2;
  const data::Recording recording = import_tracks(settings_);
  ASSERT_EQ(recording.keyframes.size(), 3u);
  EXPECT_EQ(recording.keyframes[2].time, 0.04);
}

TEST_F(TrackImport, LeavesNothingBehindWhereItFails) {
  const auto message = [&] {
    std::string text = data::input_error_of([&] { import_tracks(settings_); });
    EXPECT_FALSE(std::filesystem::exists(settings_.out)) << text;
    return text;
  };
  settings_.clamp.min.x() = settings_.clamp.max.x() = 5;
  EXPECT_NE(message().find("import: recording.json: supports[0].select: no vertex"), std::string::npos);
  settings_.clamp = {};
  settings_.clamp.max.x() = 0;
  settings_.every = 5;
  EXPECT_NE(message().find("--every: leaves one time of "), std::string::npos);
  settings_.every = 1;
  settings_.clamp = {};
  EXPECT_NE(message().find("hold all 24 vertices of the object"), std::string::npos);
  settings_.clamp.max.x() = 0;
  settings_.on_support = {"bass"};
  EXPECT_NE(message().find("did you mean \"base\"?"), std::string::npos);
  EXPECT_EQ(message(), "import: recording.json: markers.on_support: found marker \"bass\", expected one of " +
                           settings_.tracks + " (did you mean \"base\"?)");
  settings_.on_support = {"base"};
  settings_.placed = folder_.write("places.csv", "marker,x,y,z\nbase,5,0,0\ntop,0,0,0\n");
  EXPECT_EQ(message(), "import: recording.json: markers.placed: found marker \"top\", expected one of " +
                           settings_.tracks + " (did you mean \"tip\"?)");
  settings_.mesh_spec = folder_ / "missing.vtk";
  EXPECT_NE(message().find("--mesh: found"), std::string::npos);
}

}  // namespace
}  // namespace flash::sysid
