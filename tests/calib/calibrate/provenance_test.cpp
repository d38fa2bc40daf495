#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "calib/calibrate/extrinsics.h"
#include "calib/solve/pose_space.h"
#include "data/atomic_file.h"
#include "data/json_reader.h"
#include "tests/calib/hand_eye_scene.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

namespace fs = std::filesystem;

/// The current folder, put back afterwards.
class CurrentFolder {
 public:
  explicit CurrentFolder(const std::string& path) : before_(fs::current_path()) { fs::current_path(path); }
  ~CurrentFolder() { fs::current_path(before_); }
  CurrentFolder(const CurrentFolder&) = delete;
  CurrentFolder& operator=(const CurrentFolder&) = delete;

 private:
  fs::path before_;
};

TEST(Provenance, PathsHoldFromTheFolderOfTheFileAndWhenBothAreMoved) {
  const data::TemporaryFolder folder;
  folder.write("cell/recording/poses.tum", "");
  folder.write("cell/results/camera.json", "");
  folder.write("elsewhere/nothing", "");
  ExtrinsicsInputs inputs{"recording", "chessboard:9x6:0.025", "recording/poses.tum", "", "ours"};
  {
    const CurrentFolder here(folder / "cell");
    inputs = relative_to(inputs, "results/camera.json");
  }
  EXPECT_EQ(inputs.dataset, "../recording");
  EXPECT_EQ(inputs.poses, "../recording/poses.tum");
  EXPECT_EQ(inputs.target, "chessboard:9x6:0.025");
  EXPECT_EQ(inputs.camera, "");
  const CurrentFolder there(folder / "elsewhere");
  EXPECT_TRUE(fs::equivalent(resolved(inputs.dataset, "../cell/results/camera.json"), "../cell/recording"));
  fs::rename(folder / "cell", folder / "moved");
  EXPECT_TRUE(fs::equivalent(resolved(inputs.poses, folder / "moved/results/camera.json"),
                             folder / "moved/recording/poses.tum"));
  fs::rename(folder / "moved/recording", folder / "moved/gone");
  const std::string message =
      data::input_error_of([&] { resolved(inputs.dataset, folder / "moved/results/camera.json"); });
  EXPECT_NE(message.find("camera.json: provenance: found ../recording, which is neither"), std::string::npos)
      << message;
}

TEST(Provenance, FilesOfOldAreReadFromTheCurrentFolder) {
  const data::TemporaryFolder folder;
  folder.write("recording/poses.tum", "");
  folder.write("results/camera.json", "");
  const CurrentFolder here(folder / "");
  EXPECT_EQ(resolved("recording", "results/camera.json"), "recording");
}

TEST(PoseSpace, ResultSaysSoAndHasNoPixels) {
  SceneSettings settings = protocol_settings(Setup::eye_to_hand);
  settings.robot_deg = 0.1;
  settings.robot_mm = 1;
  HandEyeScene scene = make_scene(settings, board_points(), 4);
  for (Observation& view : scene.observations) {
    view.points.clear();
    view.pixels.resize(2, 0);
  }
  const Calibration result = calibrate_pairs(Setup::eye_to_hand, scene.observations);
  const nlohmann::ordered_json json = to_json(result, {"cell.samples", "", "", "", ""}, 0);
  EXPECT_EQ(json["method"], "pose_space");
  for (const char* field : {"reprojection_rms_px", "corner_rms_px", "centre_rms_px", "heldout_px"})
    EXPECT_TRUE(json["residuals"][field].is_null()) << field;
  EXPECT_GT(json["residuals"]["heldout_mm"], 0);
  EXPECT_TRUE(json["sigmas"]["corner_px"].is_null());
  EXPECT_TRUE(json["views"][0]["px"].is_null());
  EXPECT_TRUE(json["depth"].is_null() && json["time_offset"].is_null());
  for (const auto& [name, method] : json["comparison"].items())
    EXPECT_TRUE(method["reprojection_rms_px"].is_null()) << name;
  const data::TemporaryFolder folder;
  const Extrinsics loaded = load_extrinsics(folder.write("pairs.json", data::format_json(json)));
  EXPECT_FALSE(loaded.pixels);
  EXPECT_EQ(loaded.method, "pose_space");
}

TEST(Extrinsics, DepthAndTimeOffsetAreSavedAndLoaded) {
  const HandEyeScene scene = make_scene(protocol_settings(Setup::eye_in_hand), board_points(), 1);
  const Calibration result = calibrate(Setup::eye_in_hand, scene.camera, scene.points,
                                       grid_symmetries(scene.points), scene.observations);
  ExtrinsicsInputs inputs{"recording", "chessboard:9x6:0.025", "poses.tum", "camera_info.yaml", "ours"};
  inputs.depth = DepthUse{.used = true, .views = 12, .scale = 0.00025, .sigma = 0.0004};
  inputs.time_offset = TimeOffset{0.03, 0.001};
  const nlohmann::ordered_json json = to_json(result, inputs, 0);
  EXPECT_EQ(json["depth"]["views"], 12);
  EXPECT_EQ(json["sigmas"]["depth_m"], 0.0004);
  const data::TemporaryFolder folder;
  const Extrinsics loaded = load_extrinsics(folder.write("camera.json", data::format_json(json)));
  ASSERT_TRUE(loaded.inputs.depth && loaded.inputs.time_offset);
  EXPECT_EQ(loaded.inputs.depth->scale, 0.00025);
  EXPECT_EQ(loaded.inputs.time_offset->estimate, 0.03);
  EXPECT_TRUE(loaded.pixels);
}

}  // namespace
}  // namespace flash::calib
