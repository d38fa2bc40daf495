#include "calib/calibrate/extrinsics.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "data/atomic_file.h"
#include "data/error.h"
#include "data/json_reader.h"
#include "tests/calib/hand_eye_scene.h"

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

TEST(Extrinsics, RosUrdfAndEasyHandeyeSayTheSameTransform) {
  for (const Eigen::Vector3d& rotation : {Eigen::Vector3d(0.3, -0.8, 2), Eigen::Vector3d(0, M_PI / 2, 0)}) {
    const NamedTransform transform{"tool0", "camera", make_pose({0.1, -0.2, 0.3}, rotation)};
    double x, y, z, r, p, w;
    const std::string urdf = urdf_joint(transform);
    ASSERT_EQ(std::sscanf(urdf.substr(urdf.find("xyz=")).c_str(), "xyz=\"%lf %lf %lf\" rpy=\"%lf %lf %lf\"",
                          &x, &y, &z, &r, &p, &w),
              6);
    const Eigen::Matrix3d from_rpy =
        (Eigen::AngleAxisd(w, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(p, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(r, Eigen::Vector3d::UnitX()))
            .toRotationMatrix();
    EXPECT_LT((from_rpy - transform.T.linear()).norm(), 1e-7);  // nine digits
    EXPECT_LT((Eigen::Vector3d(x, y, z) - transform.T.translation()).norm(), 1e-8);

    const std::string ros = ros_static_transform(transform);
    double qx, qy, qz, qw;
    ASSERT_EQ(std::sscanf(ros.substr(ros.find("--qx")).c_str(), "--qx %lf --qy %lf --qz %lf --qw %lf", &qx,
                          &qy, &qz, &qw),
              4);
    EXPECT_LT((Eigen::Quaterniond(qw, qx, qy, qz).toRotationMatrix() - transform.T.linear()).norm(), 1e-7);
    EXPECT_NE(ros.find("--frame-id tool0 --child-frame-id camera"), std::string::npos);
    const std::string calib = easy_handeye2(transform, Setup::eye_in_hand);
    EXPECT_NE(calib.find("calibration_type: eye_in_hand"), std::string::npos);
    EXPECT_NE(calib.find("robot_effector_frame: tool0"), std::string::npos);
  }
}

}  // namespace
}  // namespace flash::calib
