#include "calib/report/extrinsics_json.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "calib/calibrate/calibrate_pairs.h"
#include "data/files/json_reader.h"
#include "tests/calib/hand_eye_scene.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

TEST(ExtrinsicsJson, OfPosePairsSaysSoAndHasNoPixels) {
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

TEST(ExtrinsicsJson, WhatItWasMadeFromIsSavedAndLoaded) {
  const HandEyeScene scene = make_scene(protocol_settings(Setup::eye_in_hand), board_points(), 1);
  CalibrateSettings settings;
  settings.use = Use::two_arms;
  const Calibration result = calibrate(Setup::eye_in_hand, scene.camera, scene.points,
                                       grid_symmetries(scene.points), scene.observations, settings);
  ExtrinsicsInputs inputs{"recording", "chessboard:9x6:0.025", "poses.tum", "camera_info.yaml", "ours"};
  inputs.depth = DepthUse{.used = true, .views = 12, .scale = 0.00025, .sigma = 0.0004};
  inputs.time_offset = TimeOffset{0.03, 0.001};
  inputs.robot = "arm.urdf";
  inputs.base_link = "base";
  inputs.tip_link = "tool";
  const nlohmann::ordered_json json = to_json(result, inputs, 0);
  EXPECT_EQ(json["depth"]["views"], 12);
  EXPECT_EQ(json["sigmas"]["depth_m"], 0.0004);
  const data::TemporaryFolder folder;
  const Extrinsics loaded = load_extrinsics(folder.write("camera.json", data::format_json(json)));
  ASSERT_TRUE(loaded.inputs.depth && loaded.inputs.time_offset);
  EXPECT_EQ(loaded.inputs.depth->scale, 0.00025);
  EXPECT_EQ(loaded.inputs.time_offset->estimate, 0.03);
  EXPECT_TRUE(loaded.pixels);
  EXPECT_EQ(loaded.use, Use::two_arms);
  EXPECT_FALSE(loaded.size_unknown);
  nlohmann::ordered_json unknown = json;
  unknown["scale"]["prior_sd"] = nullptr;  // as --target-size solved writes it
  unknown["scale"]["solved"] = true;
  EXPECT_TRUE(load_extrinsics(folder.write("unknown.json", data::format_json(unknown))).size_unknown);
  EXPECT_EQ(loaded.inputs.robot, "arm.urdf");
  EXPECT_EQ(loaded.inputs.base_link, "base");
  EXPECT_EQ(loaded.inputs.tip_link, "tool");
}

TEST(ExtrinsicsJson, TheLensIsAsStatedOnlyWhereItIs) {
  const HandEyeScene scene = make_scene(protocol_settings(Setup::eye_in_hand), board_points(), 1);
  data::CameraIntrinsics stated = scene.camera;
  stated.cx += 3;
  for (const bool kept : {false, true}) {
    CalibrateSettings settings;
    settings.lens = kept ? LensKnowledge::stated : LensKnowledge::near;
    const Calibration result = calibrate(Setup::eye_in_hand, stated, scene.points,
                                         grid_symmetries(scene.points), scene.observations, settings);
    const nlohmann::ordered_json json = to_json(result, {"recording", "", "", "", ""}, 0);
    EXPECT_EQ(json["lens"]["as_stated"], kept);
    EXPECT_EQ(json["lens"]["solved"], !kept);
    const data::TemporaryFolder folder;
    const Extrinsics loaded = load_extrinsics(folder.write("camera.json", data::format_json(json)), true);
    EXPECT_EQ(loaded.stated_lens->cx, stated.cx);
    EXPECT_EQ(loaded.lens->cx, result.refined.bundle.intrinsics.front().cx);
  }
}

}  // namespace
}  // namespace flash::calib
