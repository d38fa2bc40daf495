#include "calib/dataset/dataset.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "data/files/error.h"
#include "data/picture/picture.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

const char* const kCamera =
    "image_width: 8\nimage_height: 6\ncamera_matrix: {rows: 3, cols: 3, data: [10, 0, 4, 0, 10, 3, 0, 0, "
    "1]}\n";

/// images/000.png ... and camera_info.yaml.
void write_pictures(const data::TemporaryFolder& folder, const std::vector<std::string>& names) {
  std::filesystem::create_directories(folder / "images");
  for (const std::string& name : names)
    data::save_png(data::Picture(8, 6, {0, 0, 0}), folder / ("images/" + name));
  folder.write("camera_info.yaml", kCamera);
}

std::string message_of(const data::TemporaryFolder& folder, const DatasetOptions& options = {}) {
  return data::input_error_of([&] { load_dataset(folder / "", options); });
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(Dataset, PosesPairWithPicturesByNumber) {
  const data::TemporaryFolder folder;
  write_pictures(folder, {"frame_2.png", "frame_10.png"});
  folder.write("poses.tum", "2 0.1 0 0 0 0 0 1\n3 0.2 0 0 0 0 0 1\n10 0.3 0 0 0 0 0 1\n");
  folder.write("target.json", R"({"setup": "eye-to-hand", "target": "chessboard:9x6:0.025"})");
  const Dataset dataset = load_dataset(folder / "");
  ASSERT_EQ(dataset.frames.size(), 2u);
  EXPECT_EQ(dataset.frames[0].name, "frame_2.png");  // by number, not by letter
  EXPECT_EQ(dataset.frames[1].T_base_gripper.translation().x(), 0.3);
  EXPECT_EQ(dataset.setup, Setup::eye_to_hand);
  EXPECT_FALSE(dataset.stream);
  ASSERT_EQ(dataset.notices.size(), 1u);
  EXPECT_TRUE(contains(dataset.notices[0], "1 of 3 poses"));
}

TEST(Dataset, PosesPairByNameByFileAndByTime) {
  {
    const data::TemporaryFolder folder;
    write_pictures(folder, {"a.png", "b.png"});
    folder.write("poses.csv",
                 "image;x;y;z;roll_deg;pitch_deg;yaw_deg\nb.png;0;0;2;0;0;90\na.png;0;0;1;0;0;0\n");
    const Dataset dataset = load_dataset(folder / "");
    EXPECT_EQ(dataset.frames[1].T_base_gripper.translation().z(), 2);
    EXPECT_TRUE(dataset.frames[1].T_base_gripper.linear().col(0).isApprox(Eigen::Vector3d::UnitY()));
    ASSERT_TRUE(dataset.frames[1].angles);
    EXPECT_NEAR(dataset.frames[1].angles->z(), M_PI / 2, 1e-12);
  }
  {
    const data::TemporaryFolder folder;
    write_pictures(folder, {"image-1.png", "image-2.png"});
    std::filesystem::create_directories(folder / "poses");
    folder.write("poses/pose-1.yaml",
                 "rows: 6\ncols: 1\ndata:\n  - [1]\n  - [0]\n  - [0]\n  - [0]\n  - [0]\n  - [1.5]\n");
    folder.write("poses/pose-2.yaml", "{x: 2, y: 0, z: 0, qx: 0, qy: 0, qz: 0, qw: 1}");
    const Dataset dataset = load_dataset(folder / "");
    EXPECT_NEAR(Eigen::AngleAxisd(dataset.frames[0].T_base_gripper.linear()).angle(), 1.5, 1e-12);
    EXPECT_EQ(dataset.frames[1].T_base_gripper.translation().x(), 2);
  }
  {
    const data::TemporaryFolder folder;
    write_pictures(folder, {"100.25.png"});
    folder.write("poses.tum", "100.1 0 0 0 0 0 0 1\n100.2 1 0 0 0 0 0 1\n100.3 2 0 0 0 0 0 1\n");
    const Dataset dataset = load_dataset(folder / "");
    EXPECT_NEAR(dataset.frames[0].T_base_gripper.translation().x(), 1.5, 1e-9);
    ASSERT_TRUE(dataset.stream);
    EXPECT_EQ(dataset.stream->times.size(), 3u);
  }
}

TEST(Dataset, PairsNeedNoPictures) {
  const data::TemporaryFolder folder;
  folder.write(
      "robot.samples",
      "samples:\n- robot:\n    translation: {x: 1, y: 2, z: 3}\n    rotation: {x: 0, y: 0, z: 0, w: 1}\n"
      "  tracking:\n    translation: {x: 0, y: 0, z: 1}\n    rotation: {x: 1, y: 0, z: 0, w: 0}\n");
  const Dataset dataset = load_dataset(folder / "");
  const std::vector<Observation> observations = pair_observations(dataset);
  ASSERT_EQ(observations.size(), 1u);
  EXPECT_EQ(observations[0].T_base_gripper.translation().y(), 2);
  EXPECT_EQ(observations[0].T_camera_target.at(0).translation().z(), 1);
  EXPECT_EQ(observations[0].pixels.cols(), 0);
  folder.write("pose_samples.json",
               "[[[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]], [[1,0,0,0],[0,1,0,0],[0,0,2,0],[0,0,0,1]]]]");
  EXPECT_TRUE(
      contains(data::input_error_of([&] { load_dataset(folder / "pose_samples.json"); }),
               "pair 0: found a matrix that is no rotation: its column 3 has length 2 (R(2,2) is 2)"));
}

TEST(Dataset, ErrorsAreOneLineThatNamesTheCause) {
  const data::TemporaryFolder folder;
  EXPECT_TRUE(contains(message_of(folder), "found no pictures"));
  write_pictures(folder, {"000.png", "001.png"});
  EXPECT_TRUE(contains(message_of(folder), "found no poses"));
  folder.write("poses.tum", "0 0.1 0 0 0 0 0 1\n");
  EXPECT_TRUE(contains(load_dataset(folder / "").guesses.at(0), "001.png: no pose with number 1"));
  folder.write("poses.tum", "7 0.1 0 0 0 0 0 1\n");
  EXPECT_TRUE(contains(message_of(folder), "000.png: no pose with number 0"));
  folder.write("poses.tum", "0 0.1 0 0 0 0 0 1\n1 0.1 0 0 0 0 0 1.2\n");
  EXPECT_TRUE(contains(message_of(folder), "quaternion has length 1.2"));
  folder.write("poses.tum", "0 400 300 0 0 0 0 1\n1 410 300 20 0 0 0 1\n");
  EXPECT_TRUE(contains(message_of(folder), "are these millimetres?"));
  folder.write("poses.csv", "index,tx,ty,tz,rx,ry,rz\n0,0,0,0,0,0,0\n1,0,0,0,90,0,0\n");
  EXPECT_TRUE(contains(message_of(folder), "found poses in poses.tum and in poses.csv"));
  DatasetOptions options;
  options.poses = folder / "poses.csv";
  EXPECT_TRUE(contains(message_of(folder, options), "degrees?"));
  std::filesystem::remove(folder / "camera_info.yaml");
  EXPECT_TRUE(contains(message_of(folder), "found no intrinsics"));
}

TEST(Dataset, CamchainIsRead) {
  const data::TemporaryFolder folder;
  write_pictures(folder, {"0.png"});
  std::filesystem::remove(folder / "camera_info.yaml");
  folder.write("camchain.yaml",
               "cam0:\n  camera_model: pinhole\n  intrinsics: [10, 11, 4, 3]\n  resolution: [8, 6]\n"
               "  distortion_model: radtan\n  distortion_coeffs: [-0.1, 0.01, 0.001, 0.002]\n");
  folder.write("poses.tum", "0 0.1 0 0 0 0 0 1\n");
  const Dataset dataset = load_dataset(folder / "");
  ASSERT_TRUE(dataset.camera);
  EXPECT_EQ(dataset.camera->fy, 11);
  EXPECT_EQ(dataset.camera->distortion, (std::vector<double>{-0.1, 0.01, 0.001, 0.002, 0}));
}

TEST(Dataset, EverySharedSetLoadsAsItIs) {
  const std::filesystem::path shared = std::filesystem::path(FLASH_SHARED_DIR) / "data" / "handeye";
  if (!std::filesystem::exists(shared)) GTEST_SKIP() << "no shared data";
  EXPECT_EQ(load_dataset((shared / "pairs_moveit").string()).frames.size(), 50u);
  for (const auto& [name, frames] :
       {std::pair("eih_aubo_chessboard", 20), std::pair("eth_franka_apriltag", 8),
        std::pair("sim_metric/camera2", 33)}) {
    const Dataset dataset = load_dataset((shared / name).string());
    EXPECT_EQ(dataset.frames.size(), static_cast<std::size_t>(frames)) << name;
    EXPECT_TRUE(dataset.setup && dataset.camera && !dataset.target.empty()) << name;
  }
}

TEST(Dataset, PipesAmongThePicturesAreNamed) {
  const data::TemporaryFolder folder;
  write_pictures(folder, {"1.png", "2.png"});
  folder.write("poses.tum", "1 0 0 0 0 0 0 1\n2 0.1 0 0 0 0 0 1\n3 0.2 0 0 0 0 0 1\n");
  ASSERT_EQ(::mkfifo((folder / "images/3.png").c_str(), 0600), 0);
  EXPECT_TRUE(contains(message_of(folder), "images/3.png: is a device, a pipe or a socket, expected a file"))
      << message_of(folder);
}

}  // namespace
}  // namespace flash::calib
