#include "sysid/capture/import.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "data/camera/depth_image.h"
#include "data/camera/extrinsics.h"
#include "data/files/atomic_file.h"
#include "data/files/text.h"
#include "data/mesh/mesh_io.h"
#include "data/mesh/procedural_mesh.h"
#include "data/recording/frame_files.h"
#include "tests/data/temporary_folder.h"

namespace flash::sysid {
namespace {

void set_sheet(const std::string& spec, ImportSettings& settings) {
  settings.mesh_spec = spec;
  settings.mesh = data::parse_mesh_spec(spec);
}

/// Clouds of a 0.2 m sheet on a table at z = 0.05 m, grasped at (0.5, 0.1), its diagonal along +y.
class ImportFiles : public testing::Test {
 protected:
  ImportFiles() {
    folder_.write("tcp.csv", "t,tx,ty,tz,qx,qy,qz,qw\n0,0.5,0.1,0.052,0,0,0,1\n0.2,0.5,0.15,0.15,0,0,0,1\n");
    data::Points cloud(4, 3);
    cloud << 0.5, 0.2, 0.06, 0.45, 0.24, 0.06, 0.55, 0.24, 0.06, 0.5, 0.28, 0.06;
    for (const char* name : {"clouds/2.ply", "clouds/10.pcd", "clouds/11.ply"})
      data::save_point_cloud(cloud, folder_ / name);
    cloud(3, 0) += 1e-3;
    data::save_point_cloud(cloud, folder_ / "clouds/11.ply");
    folder_.write("clouds/notes.txt", "not a cloud");
    settings_.clouds = clouds();
    load_gripper();
    set_sheet("sheet:0.2x0.2:0.02:alternating", settings_);
    settings_.grasp.within = 0.024;
    settings_.crop.min.z() = 0.055;
    settings_.table_height = 0.05;
    settings_.out = folder_ / "lift";
  }

  void load_gripper() {
    settings_.trajectory_path = folder_ / "tcp.csv";
    settings_.trajectory = data::load_trajectory(settings_.trajectory_path);
  }

  std::vector<std::string> clouds() const {
    return data::files_in_order(folder_ / "clouds", {".ply", ".pcd"});
  }

  data::TemporaryFolder folder_;
  ImportSettings settings_;
};

// The gripper stands still for 3 s, then lifts; the clouds begin at 2 s.
TEST_F(ImportFiles, TheGraspBeginsByTheClockOfTheFilesWhenTheGripperSetsOff) {
  const auto grasp_of = [&](double first_pose, double first_cloud) {
    const auto pose = [&](double t, const char* y) {
      return data::format_number(first_pose + t) + ",0.5," + y + ",0.052,0,0,0,1\n";
    };
    folder_.write("tcp.csv", "t,tx,ty,tz,qx,qy,qz,qw\n" + pose(0, "0.1") + pose(3, "0.1") + pose(4, "0.15"));
    load_gripper();
    settings_.times = {first_cloud, first_cloud + 0.1, first_cloud + 0.2};
    settings_.overwrite = true;
    const data::Recording recording = import_recording(settings_);
    return recording.origin + recording.grasps[0].from;
  };
  EXPECT_EQ(grasp_of(1.764e9, 1.764e9 + 2), 1.764e9 + 2);
  EXPECT_EQ(grasp_of(1000, 1003.5), 1003);
  EXPECT_EQ(grasp_of(0, 0), 0);
}

TEST_F(ImportFiles, CloudsAndATrajectoryBecomeARecording) {
  settings_.nuisance.offset.setConstant(0.06);
  const data::Recording recording = import_recording(settings_);
  EXPECT_EQ(recording.name, "lift");
  EXPECT_EQ(recording.keyframes.size(), 3u);
  EXPECT_DOUBLE_EQ(recording.keyframes[2].time, 0.2);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "lift/frames/000002.ply"));
  // 2, 10, 11: the numbers count, not the letters.
  std::vector<std::string> notices;
  EXPECT_NEAR(data::load_keyframes(recording, notices)[2].cloud(3, 0), 0.501, 1e-6);
  EXPECT_EQ(recording.crop.min.z(), 0.055);
  EXPECT_EQ(recording.nuisance.offset, Eigen::Vector3d::Constant(0.06));
  EXPECT_EQ(data::select_vertices(recording, recording.grasps[0]).size(), 4u);
  // The guess: corner (0, 0) under the gripper, the opposite one 0.2 sqrt(2) further along +y.
  EXPECT_TRUE(recording.start.row(0).isApprox(Eigen::RowVector3d(0.5, 0.1, 0.05), 1e-9));
  EXPECT_TRUE(recording.start.row(recording.start.rows() - 1)
                  .isApprox(Eigen::RowVector3d(0.5, 0.1 + 0.2 * std::numbers::sqrt2, 0.05), 1e-6));
  bool told = false;
  for (const std::string& notice : recording.notices)
    told |= notice.find("diagonal points to 90 deg") != std::string::npos;
  EXPECT_TRUE(told);
}

TEST_F(ImportFiles, EveryCornerCanBeTheGraspedOne) {
  for (int k = 0; k < 4; ++k) {
    const std::array<int, 2> corner{k / 2, k % 2};
    settings_.grasp.corner = corner;
    settings_.overwrite = true;
    const data::Recording recording = import_recording(settings_);
    const std::vector<int> held = data::select_vertices(recording, recording.grasps[0]);
    double nearest = 1;
    for (const int vertex : held)
      nearest = std::min(nearest, (recording.start.row(vertex) - Eigen::RowVector3d(0.5, 0.1, 0.05)).norm());
    EXPECT_LT(nearest, 1e-9) << k;
    EXPECT_NEAR(recording.start.col(0).mean(), 0.5, 1e-6) << k;
    EXPECT_NEAR(recording.start.col(1).mean(), 0.1 + 0.1 * std::numbers::sqrt2, 1e-6) << k;
  }
}

TEST_F(ImportFiles, EveryFrameHasATime) {
  settings_.times = {0.01, 0.11, 0.19};
  EXPECT_DOUBLE_EQ(import_recording(settings_).keyframes[1].time, 0.11);
  settings_.overwrite = true;
  settings_.times = {0.01, 0.11};
  EXPECT_EQ(data::input_error_of([&] { import_recording(settings_); }),
            "import: found 2 times, expected 3, one a frame");
  settings_.clouds.clear();
  EXPECT_EQ(data::input_error_of([&] { import_recording(settings_); }),
            "import: found no frames, expected clouds or depth images");
}

TEST_F(ImportFiles, DepthImagesBecomePointsInTheBaseFrame) {
  data::CameraIntrinsics camera;
  camera.width = 4;
  camera.height = 4;
  camera.fx = camera.fy = 10;
  camera.cx = camera.cy = 1.5;
  data::save_camera_info(camera, folder_ / "camera.yaml");
  // 1 m above (0.5, 0.24), looking down: half a turn about x.
  folder_.write("camera.tum", "0 0.5 0.24 1.06 1 0 0 0\n");
  data::DepthImage depth{4, 4, std::vector<std::uint16_t>(16, 2000)};
  data::MaskImage mask{4, 4, std::vector<std::uint8_t>(16, 0)};
  mask.at(1, 2) = 255;
  data::save_depth_image(depth, folder_ / "depth/a.png");
  data::save_mask(mask, folder_ / "masks/a.png");
  settings_.clouds.clear();
  settings_.depth = {folder_ / "depth/a.png"};
  settings_.masks = folder_ / "masks";
  settings_.intrinsics = folder_ / "camera.yaml";
  settings_.extrinsics = folder_ / "camera.tum";
  settings_.depth_scale = 0.0005;
  const data::Recording recording = import_recording(settings_);
  std::vector<std::string> notices;
  const data::Points cloud = data::load_keyframes(recording, notices)[0].cloud;
  ASSERT_EQ(cloud.rows(), 1);
  // Pixel (1, 2): x -0.05, y 0.05 in the camera, which in the base are -0.05 and -0.05.
  EXPECT_TRUE(cloud.row(0).isApprox(Eigen::RowVector3d(0.45, 0.19, 0.06), 1e-9)) << cloud;

  folder_.write("camera.json",
                R"({"schema": "flash-extrinsics/1", "setup": "eye-to-hand", "transform": {"parent": "base",
    "child": "camera", "translation": [0.5, 0.24, 1.06], "rotation_xyzw": [1, 0, 0, 0]}})");
  EXPECT_TRUE(data::load_camera_pose(folder_ / "camera.json", false)
                  .transform.T.isApprox(data::load_camera_pose(folder_ / "camera.tum", false).transform.T));
  settings_.overwrite = true;
  folder_.write(
      "camera.json",
      R"({"schema": "flash-extrinsics/1", "exit_code": 3, "warnings": ["one axis only"], "transform": {
    "translation": [0.5, 0.24, 1.06], "rotation_xyzw": [1, 0, 0, 0]}})");
  settings_.extrinsics = folder_ / "camera.json";
  EXPECT_NE(data::input_error_of([&] { import_recording(settings_); }).find("cannot be used (one axis only)"),
            std::string::npos);
  settings_.accept_unusable = true;
  const std::vector<std::string> said = import_recording(settings_).notices;
  EXPECT_NE(std::find(said.begin(), said.end(), (folder_ / "camera.json") + ": one axis only"), said.end());
}

TEST_F(ImportFiles, AnotherLensThanThatOfTheExtrinsicsIsRefusedAndTheirsTravels) {
  data::CameraIntrinsics camera;
  camera.width = camera.height = 4;
  camera.fx = camera.fy = 10;
  camera.cx = camera.cy = 1.5;
  data::save_camera_info(camera, folder_ / "camera.yaml");
  data::save_depth_image({4, 4, std::vector<std::uint16_t>(16, 1000)}, folder_ / "depth/a.png");
  folder_.write("camera.json",
                R"({"schema": "flash-extrinsics/2", "transform": {"translation": [0.5, 0.24, 1.06],
                    "rotation_xyzw": [1, 0, 0, 0]}, "lens": {"size_px": [4, 4], "focal_px": [12, 12],
                    "centre_px": [1.5, 1.5], "distortion": []}})");
  settings_.clouds.clear();
  settings_.depth = {folder_ / "depth/a.png"};
  settings_.intrinsics = folder_ / "camera.yaml";
  settings_.extrinsics = folder_ / "camera.json";
  const std::string said = data::input_error_of([&] { import_recording(settings_); });
  for (const std::string& part : {settings_.intrinsics, settings_.extrinsics, std::string("fx 10.00"),
                                  std::string("fx 12.00"), std::string("--lens solved")})
    EXPECT_NE(said.find(part), std::string::npos) << said;
  const auto imported_focal = [&] { return import_recording(settings_).camera->intrinsics.fx; };
  settings_.lens = data::LensChoice::solved;
  EXPECT_EQ(imported_focal(), 12);
  settings_.overwrite = true;
  settings_.lens = data::LensChoice::stated;
  EXPECT_EQ(imported_focal(), 10);
  settings_.lens = data::LensChoice::agreeing;
  settings_.intrinsics.clear();
  EXPECT_EQ(imported_focal(), 12);
}

TEST_F(ImportFiles, WhichSideIsTheWidthIsComparedWithTheSheetThatStillLies) {
  // Seen from above, from the grasped corner: 0.3 m to the left (+x), 0.2 m to the right (+y).
  data::Points cloud(31 * 21, 3);
  for (int i = 0; i < 31; ++i)
    for (int j = 0; j < 21; ++j) cloud.row(21 * i + j) << 0.5 - 0.01 * i, 0.1 + 0.01 * j, 0.06;
  for (const char* name : {"clouds/2.ply", "clouds/10.pcd", "clouds/11.ply"})
    data::save_point_cloud(cloud, folder_ / name);
  settings_.overwrite = true;
  const auto told = [&](const std::string& sheet, const std::array<int, 2>& corner) {
    set_sheet("sheet:" + sheet + ":0.02", settings_);
    settings_.grasp.corner = corner;
    for (const std::string& notice : import_recording(settings_).notices)
      if (notice.find("--mesh says") != std::string::npos) return notice;
    return std::string();
  };
  EXPECT_EQ(told("0.2x0.3", {0, 0}), "");
  EXPECT_EQ(told("0.2x0.3", {1, 1}), "");
  EXPECT_EQ(told("0.3x0.2", {1, 0}), "");
  EXPECT_NE(told("0.3x0.2", {0, 0}).find("swap the sides, --mesh sheet:0.2x0.3:0.02, or name"),
            std::string::npos);
  EXPECT_NE(told("0.2x0.3", {0, 1}), "");
  // Where the heading is known, they are refused, and accepted with a warning.
  settings_.heading = std::atan2(0.2, -0.3);
  EXPECT_EQ(told("0.2x0.3", {0, 0}), "");
  EXPECT_TRUE(
      data::input_error_of([&] {
        told("0.3x0.2", {0, 0});
      })
          .starts_with("import: the cloth lies with 200 mm on the right hand of its diagonal and 300 mm "
                       "on the left, and --mesh says 300 mm and 200 mm"));
  settings_.accept_unusable = true;
  EXPECT_NE(told("0.3x0.2", {0, 0}), "");
}

TEST_F(ImportFiles, TheMiddleOfThePatchCanBeAtTheTool) {
  settings_.tool_at_patch = true;
  settings_.grasp.within = 0.04;
  const data::Recording recording = import_recording(settings_);
  Eigen::RowVector3d middle = Eigen::RowVector3d::Zero();
  const std::vector<int> held = data::select_vertices(recording, recording.grasps[0]);
  for (const int vertex : held) middle += recording.start.row(vertex) / static_cast<double>(held.size());
  EXPECT_TRUE(middle.isApprox(Eigen::RowVector3d(0.5, 0.1, 0.05), 1e-9)) << middle;
}

TEST_F(ImportFiles, ATableAboveTheGripperIsDoubted) {
  const auto doubts = [&](double table_height) {
    settings_.table_height = table_height;
    settings_.out = folder_ / (table_height < 0.055 ? "known" : "doubted");
    const std::vector<std::string> notices = import_recording(settings_).notices;
    return std::count_if(notices.begin(), notices.end(), [](const std::string& notice) {
      return notice.find("warning: --table-z: found") != std::string::npos;
    });
  };
  EXPECT_EQ(doubts(0.05), 0);
  EXPECT_EQ(doubts(0.06), 1);
}

TEST_F(ImportFiles, AFlangeForTheToolIsAskedFor) {
  const auto said = [&] { return data::input_error_of([&] { import_recording(settings_); }); };
  for (Eigen::Isometry3d& pose : settings_.trajectory.poses) pose.translation().z() += 0.15;
  EXPECT_NE(
      said().find("; it starts 0.152 m above the table: is the trajectory that of the flange, in place of "
                  "the tool centre point?"),
      std::string::npos)
      << said();
  for (Eigen::Isometry3d& pose : settings_.trajectory.poses) pose.translation().z() += 0.5;
  EXPECT_EQ(said().find("flange"), std::string::npos) << said();  // no tool is so long
}

TEST_F(ImportFiles, SenselessSettingsAreRefusedByTheirNames) {
  const auto message = [&](auto change) {
    ImportSettings settings = settings_;
    change(settings);
    return data::input_error_of([&] { import_recording(settings); });
  };
  EXPECT_EQ(message([](ImportSettings& o) { o.asset = "nowhere.json"; }),
            "--asset: found \"nowhere.json\", expected a file");
  EXPECT_EQ(message([](ImportSettings& o) { o.trajectory = {}; }),
            "import: found 0 poses of the gripper, expected two or more");
  EXPECT_NE(message([](ImportSettings& o) {
              o.times = {1.764e9, 1.764e9 + 0.1, 1.764e9 + 0.2};
            }).find("expected one clock for both"),
            std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "lift"));
}

TEST_F(ImportFiles, TheAssetIsNamedFromTheRecording) {
  settings_.asset = folder_.write("towel.json", R"({"schema": "flash-asset/1", "mesh": "sheet:0.2x0.2:0.02",
      "element_type": "TRIANGLE", "mechanical_props": {"constitutive": "TRI_COROTATED", "young": 1e5, "poisson": 0.3,
      "thickness": 0.001, "areal_density": 0.2}})");
  for (const bool again : {false, true}) {
    settings_.overwrite = again;
    EXPECT_EQ(std::filesystem::weakly_canonical(import_recording(settings_).asset),
              std::filesystem::weakly_canonical(settings_.asset));
    EXPECT_NE(data::read_file(folder_ / "lift/recording.json").find("\"../towel.json\""), std::string::npos);
  }
}

TEST_F(ImportFiles, WhatFailsItsCheckLeavesNothing) {
  const data::Selection corner = settings_.grasp;
  settings_.grasp.corner.reset();
  settings_.grasp.position =
      Eigen::Vector3d::Zero();  // the sheet would lie at the origin, half a metre from the gripper
  EXPECT_NE(data::input_error_of([&] { import_recording(settings_); }).find("no vertex lies within"),
            std::string::npos);
  std::size_t entries = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / "."))
    entries += !entry.path().empty();
  EXPECT_EQ(entries, 2u);  // tcp.csv, clouds
  settings_.grasp = corner;
  settings_.crop.min.z() = 1;
  EXPECT_NE(data::input_error_of([&] {
              import_recording(settings_);
            }).find("no keyframe has a point inside the crop box"),
            std::string::npos);
  settings_.crop = {};
  import_recording(settings_);
  EXPECT_NE(data::input_error_of([&] { import_recording(settings_); }).find("exists already"),
            std::string::npos);
  // A shorter recording over a longer one leaves none of its frames, but what it did not write.
  folder_.write("lift/frames/notes.txt", "mine");
  std::filesystem::remove(folder_ / "clouds/11.ply");
  settings_.clouds = clouds();
  settings_.overwrite = true;
  import_recording(settings_);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "lift/frames/000002.ply"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "lift/frames/000001.ply"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "lift/frames/notes.txt"));
}

// Without recording.json, too: they may be the only copy of what was seen.
TEST_F(ImportFiles, FramesThatStandInTheFolderAreNotWrittenOver) {
  const std::string own = folder_.write("lift/frames/000000.ply", "mine");
  EXPECT_EQ(data::input_error_of([&] { import_recording(settings_); }),
            (folder_ / "lift/frames") + ": exists already; choose another name, or --force to overwrite");
  EXPECT_EQ(data::read_file(own), "mine");
  std::filesystem::remove_all(folder_ / "lift/frames");
  folder_.write("lift/notes.txt", "mine");
  import_recording(settings_);
  EXPECT_EQ(data::read_file(folder_ / "lift/notes.txt"), "mine");
}

class ImportedClip : public testing::TestWithParam<const char*> {};

/// The shared recordings were written by hand; the import has to find the same sheet within what is fitted
/// afterwards.
TEST_P(ImportedClip, StartsNearTheRecordingMadeByHand) {
  const std::string clip = std::string(FLASH_SHARED_DIR) + "/data/" + GetParam();
  if (!std::filesystem::exists(clip)) GTEST_SKIP() << clip << " is absent";
  const data::Recording by_hand = data::load_recording(clip);
  const data::TemporaryFolder folder;
  ImportSettings settings;
  settings.clouds = data::files_in_order(clip + "/frames", {".ply"});
  settings.trajectory_path = by_hand.trajectory_paths.at("gripper");
  settings.trajectory = data::load_trajectory(settings.trajectory_path);
  const bool twin = std::string(GetParam()).starts_with("twin");
  set_sheet(twin ? "sheet:0.4x0.4:0.01:alternating" : "sheet:0.278x0.278:0.01:alternating", settings);
  if (twin) {
    settings.grasp.corner = {1, 1};
  } else {
    settings.crop.min.z() = 0.075;
    settings.crop.max.y() = 0.3;
    settings.nuisance.offset.setConstant(0.06);
  }
  settings.out = folder / "recording";
  const data::Recording imported = import_recording(settings);
  const Eigen::Matrix3d turn =
      by_hand.base_from_object.linear().transpose() * imported.base_from_object.linear();
  EXPECT_LT(std::acos(std::min(1.0, (turn.trace() - 1) / 2)), 0.35);  // the bound of start_yaw_rad
  EXPECT_LT((by_hand.start - imported.start).rowwise().norm().maxCoeff(), 0.14);
}

INSTANTIATE_TEST_SUITE_P(All, ImportedClip,
                         testing::Values("lift/lift_paper", "lift/lift_navy2", "twin/lift_a"),
                         [](const auto& parameter) {
                           std::string name = parameter.param;
                           name[name.find('/')] = '_';
                           return name;
                         });

}  // namespace
}  // namespace flash::sysid
