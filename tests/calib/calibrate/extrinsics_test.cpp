#include "calib/calibrate/extrinsics.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "calib/report/extrinsics_json.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "tests/calib/hand_eye_scene.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

struct SavedCalibration {
  Calibration calibration;
  std::string path = (std::filesystem::path(testing::TempDir()) / "extrinsics_test.json").string();
  nlohmann::ordered_json json;

  SavedCalibration() {
    SceneSettings settings = protocol_settings(Setup::eye_in_hand);
    settings.robot_deg = 0.05;
    settings.robot_mm = 0.5;
    const HandEyeScene scene = make_scene(settings, board_points(), 1);
    calibration = calibrate(Setup::eye_in_hand, scene.camera, scene.points, grid_symmetries(scene.points),
                            scene.observations);
    json = to_json(calibration,
                   {"recording", "chessboard:9x6:0.025", "poses.tum", "camera_info.yaml", "ours"}, 0);
    save();
  }
  void save() const { data::write_atomically(path, data::format_json(json)); }
};

TEST(Extrinsics, WhatIsSavedIsLoaded) {
  const SavedCalibration saved;
  const Extrinsics loaded = load_extrinsics(saved.path);
  EXPECT_EQ(loaded.setup, Setup::eye_in_hand);
  EXPECT_EQ(loaded.transform.parent, "gripper");
  EXPECT_EQ(loaded.target_pose.parent, "base");
  EXPECT_LT(motion_between(loaded.transform.T, saved.calibration.poses.X).norm(), 1e-12);
  EXPECT_LT(motion_between(loaded.target_pose.T, saved.calibration.poses.Z).norm(), 1e-12);
  EXPECT_EQ(loaded.covariance, saved.calibration.covariance);
  EXPECT_EQ(loaded.inputs.target, "chessboard:9x6:0.025");
}

TEST(Extrinsics, DamagedFilesAreNamedByFieldAndFile) {
  SavedCalibration saved;
  saved.json["covariance"][2].erase(5);
  saved.save();
  try {
    load_extrinsics(saved.path);
    FAIL();
  } catch (const data::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("extrinsics_test.json: covariance: "), std::string::npos);
  }
}

TEST(Extrinsics, CovariancesThatAreNoneAreRefused) {
  for (const auto& [value, expected] :
       {std::pair(-1.0, "no variance below 0"), {1e300, "numbers below 1e8"}}) {
    SavedCalibration saved;
    saved.json["covariance"][1][1] = value;
    saved.save();
    const std::string said = data::input_error_of([&] { load_extrinsics(saved.path); });
    EXPECT_NE(said.find(expected), std::string::npos) << said;
  }
}

TEST(Extrinsics, AnswersThatCannotBeUsedAreRefusedUnlessAccepted) {
  SavedCalibration saved;
  saved.json["exit_code"] = 3;
  saved.json["warnings"] = {"rotations turn about one axis only"};
  saved.save();
  EXPECT_THROW(load_extrinsics(saved.path), data::InputError);
  const Extrinsics accepted = load_extrinsics(saved.path, true);
  EXPECT_FALSE(accepted.usable);
  EXPECT_EQ(accepted.warnings, std::vector<std::string>{"rotations turn about one axis only"});
}

}  // namespace
}  // namespace flash::calib
