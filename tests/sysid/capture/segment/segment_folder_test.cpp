#include "sysid/capture/segment/segment_folder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>

#include "data/camera/depth_image.h"
#include "data/files/error.h"
#include "data/mesh/mesh_io.h"
#include "sysid/capture/segmented_cell.h"

namespace flash::sysid {
namespace {

namespace fs = std::filesystem;

class SegmentFolder : public testing::Test {
 protected:
  SegmentFolder()
      : root_(fs::temp_directory_path() / ("segment_folder_" + std::to_string(std::random_device()()) +
                                           testing::UnitTest::GetInstance()->current_test_info()->name())) {
    fs::create_directories(root_);
  }
  ~SegmentFolder() override { fs::remove_all(root_); }

  std::string folder(const std::string& name) const { return (root_ / name).string(); }

  fs::path root_;
};

// A camera 1 m above the table z = 0.07 looks straight down: x right, y towards the robot, z down.
const Eigen::Vector3d camera_position(0.5, 0.1, 1.07);

data::CameraIntrinsics small_camera() {
  data::CameraIntrinsics camera;
  camera.width = 160;
  camera.height = 120;
  camera.fx = camera.fy = 160;
  camera.cx = 79.5;
  camera.cy = 59.5;
  return camera;
}

// A depth image of a table with a flat square patch 0.2 m wide, `height` above it, under the camera's axis.
data::DepthImage patch_above_table(double height) {
  const data::CameraIntrinsics camera = small_camera();
  data::DepthImage image{camera.width, camera.height,
                         std::vector<std::uint16_t>(camera.width * camera.height)};
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const double z = 1.0 - height;
      const bool patch =
          std::abs((u - camera.cx) / camera.fx * z) < 0.1 && std::abs((v - camera.cy) / camera.fy * z) < 0.1;
      image.at(u, v) = static_cast<std::uint16_t>(std::lround(1000 * (patch ? z : 1.0)));
    }
  image.at(0, 0) = 0;  // nothing measured
  return image;
}

void write_depth_view(const std::string& folder, const std::vector<double>& heights) {
  fs::create_directories(folder + "/depth");
  data::save_camera_info(small_camera(), folder + "/camera_info.yaml");
  for (std::size_t k = 0; k < heights.size(); ++k)
    data::save_depth_image(patch_above_table(heights[k]), folder + "/depth/" + std::to_string(k) + ".png");
  // Half a turn about x: the optical axis points down.
  std::ofstream(folder + "/extrinsics.json")
      << R"({"schema": "flash-extrinsics/1", "transform": {"parent": "base", "child": "camera",
             "translation": [0.5, 0.1, 1.07], "rotation_xyzw": [1, 0, 0, 0]}})";
}

std::string message_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const data::InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST_F(SegmentFolder, DepthImagesBecomeTheLiftedPatchInTheBaseFrame) {
  write_depth_view(folder("raw"), {0.1, 0.2});
  SegmentFolderSettings settings;
  const SegmentedFolder result =
      segment_folder({open_raw_view(folder("raw"))}, {0.0, 0.1}, settings, folder("out"));
  ASSERT_TRUE(result.table);
  EXPECT_NEAR(result.table->plane.point.z(), 0.07, 1e-6);
  for (int k : {0, 1}) {
    const data::Points cloth = data::load_point_cloud(folder("out") + "/" + result.clouds[k]);
    ASSERT_GT(cloth.rows(), 300);
    const double height = 0.07 + 0.1 * (k + 1);
    EXPECT_LT((cloth.col(2).array() - height).abs().maxCoeff(), 1e-6);
    // The patch ends at 0.1 m from the axis, less up to one pixel and what the outlier filter takes from its
    // rim.
    EXPECT_NEAR(cloth.col(0).maxCoeff(), camera_position.x() + 0.1, 0.012);
    EXPECT_NEAR(cloth.col(0).minCoeff(), camera_position.x() - 0.1, 0.012);
    EXPECT_NEAR(cloth.col(1).mean(), camera_position.y(), 0.002);
  }
  EXPECT_TRUE(fs::exists(folder("out") + "/segment.svg"));
}

TEST_F(SegmentFolder, CamerasThatCannotBeUsedAreRefusedUnlessAccepted) {
  write_depth_view(folder("raw"), {0.1});
  std::ofstream(folder("raw") + "/extrinsics.json")
      << R"({"schema": "flash-extrinsics/1", "exit_code": 3, "warnings": ["one axis only"],
             "transform": {"translation": [0.5, 0.1, 1.07], "rotation_xyzw": [1, 0, 0, 0]}})";
  EXPECT_THROW(open_raw_view(folder("raw")), data::InputError);
  RawViewFiles files;
  files.accept_unusable = true;
  const RawView accepted = open_raw_view(folder("raw"), files);
  const std::vector<std::string> said{folder("raw") + "/extrinsics.json: one axis only"};
  EXPECT_EQ(accepted.warnings, said);
  SegmentFolderSettings settings;
  settings.find_table = false;
  EXPECT_EQ(segment_folder({accepted}, {0.0}, settings, folder("out")).warnings, said);
}

// The camera is seen with 160 px, and held to be one of 150 px, which puts the rim of the patch 7 mm off.
TEST_F(SegmentFolder, AnotherLensThanThatOfTheExtrinsicsIsRefusedOrRightToAMillimetre) {
  write_depth_view(folder("raw"), {0.1});
  const auto calibrated = [&](double stated) {
    std::ofstream(folder("raw") + "/extrinsics.json")
        << R"({"schema": "flash-extrinsics/2", "transform": {"translation": [0.5, 0.1, 1.07],
               "rotation_xyzw": [1, 0, 0, 0]}, "lens": {"size_px": [160, 120], "focal_px": [160, 160],
               "centre_px": [79.5, 59.5], "distortion": [], "stated": {"focal_px": [)"
        << stated << ", " << stated << R"(], "centre_px": [79.5, 59.5], "distortion": []}}})";
  };
  data::CameraIntrinsics other = small_camera();
  other.fx = other.fy = 150;
  data::save_camera_info(other, folder("raw") + "/camera_info.yaml");
  calibrated(155);
  EXPECT_EQ(
      message_of([&] { open_raw_view(folder("raw")); }),
      folder("raw") + "/camera_info.yaml: found fx 150.00, fy 150.00, cx 79.50, cy 59.50, but " +
          folder("raw") +
          "/extrinsics.json holds with fx 160.00, fy 160.00, cx 79.50, cy 59.50, up to 6.25 px from it: "
          "expected one lens; --lens solved takes that of " +
          folder("raw") + "/extrinsics.json, --lens stated the other");
  const auto rim = [&](const RawViewFiles& given) {
    std::size_t not_finite = 0;
    const data::Points points = load_raw_frame(open_raw_view(folder("raw"), given), 0, true, not_finite);
    double farthest = 0;
    for (const auto& point : points.rowwise())
      if (point.z() > 0.15) farthest = std::max(farthest, point.x() - camera_position.x());
    return farthest;
  };
  // Of 160 px at 0.9 m, the outermost pixel within 0.1 m is 17.5 px from the axis.
  const double right = 17.5 * 0.9 / 160;
  RawViewFiles given;
  given.lens = data::LensChoice::solved;
  EXPECT_NEAR(rim(given), right, 1e-3);
  given.lens = data::LensChoice::stated;
  EXPECT_NEAR(rim(given), 17.5 * 0.9 / 150, 1e-3);
  EXPECT_EQ(open_raw_view(folder("raw"), given).warnings.size(), 1u);
  calibrated(150);  // the lens that the calibration began with
  EXPECT_NEAR(rim({}), right, 1e-3);
  EXPECT_EQ(open_raw_view(folder("raw")).warnings.size(), 1u);
  fs::remove(folder("raw") + "/camera_info.yaml");
  EXPECT_NEAR(rim({}), right, 1e-3);
  EXPECT_TRUE(open_raw_view(folder("raw")).warnings.empty());
}

// Depth in metres as numpy writes it, a lens without the size of its pictures, and a bare 4 x 4 matrix.
TEST_F(SegmentFolder, DepthLensAndPoseMayBeOfAllKindsThatFlashCalibReads) {
  write_depth_view(folder("raw"), {0.1});
  std::size_t not_finite = 0;
  const data::Points expected = load_raw_frame(open_raw_view(folder("raw")), 0, true, not_finite);
  const data::DepthImage counts = patch_above_table(0.1);
  std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (120, 160), }";
  header.resize(117, ' ');
  fs::create_directories(folder("other/depth"));
  std::ofstream npy(folder("other/depth/0.npy"), std::ios::binary);
  npy << std::string("\x93NUMPY\x01\x00\x76\x00", 10) << header << '\n';
  for (const std::uint16_t count : counts.pixels) {
    const float metres = 0.001F * static_cast<float>(count);
    npy.write(reinterpret_cast<const char*>(&metres), sizeof metres);
  }
  npy.close();
  std::ofstream(folder("other/lens.json"))
      << R"({"mtx": [[160, 0, 79.5], [0, 160, 59.5], [0, 0, 1]], "dist": []})";
  std::ofstream(folder("other/pose.txt")) << "1 0 0 0.5\n0 -1 0 0.1\n0 0 -1 1.07\n0 0 0 1\n";
  RawViewFiles given;
  given.intrinsics = folder("other/lens.json");
  given.extrinsics = folder("other/pose.txt");
  const data::Points points = load_raw_frame(open_raw_view(folder("other"), given), 0, true, not_finite);
  ASSERT_EQ(points.rows(), expected.rows());
  EXPECT_LT((points - expected).cwiseAbs().maxCoeff(), 1e-6);  // floats of a metre have 1e-7
}

TEST_F(SegmentFolder, ViewsAreMergedFrameByFrame) {
  write_depth_view(folder("a"), {0.1});
  fs::create_directories(folder("b"));
  data::Points side(400, 3);  // a second patch 0.1 m beside the first, close enough to be one cluster with it
  for (int i = 0; i < side.rows(); ++i)
    side.row(i) << camera_position.x() + 0.1 + 0.005 * (i % 20), 0.05 + 0.005 * (i / 20), 0.17;
  data::save_point_cloud(side, folder("b") + "/000.ply");
  const SegmentedFolder result =
      segment_folder({open_raw_view(folder("a")), open_raw_view(folder("b"))}, {0.0}, {}, folder("out"));
  EXPECT_GT(result.frames[0].cloth.col(0).maxCoeff(), camera_position.x() + 0.19);
}

TEST_F(SegmentFolder, TheArmAboveTheGripperIsCutAway) {
  write_depth_view(folder("raw"), {0.1});
  fs::create_directories(folder("arm"));
  data::Points arm(500, 3);
  for (int i = 0; i < arm.rows(); ++i)
    arm.row(i) << 0.55 + 0.02 * std::cos(0.5 * i), 0.1 + 0.02 * std::sin(0.5 * i), 0.175 + 0.0005 * i;
  data::save_point_cloud(arm, folder("arm") + "/000.ply");
  SegmentFolderSettings settings;
  data::Trajectory gripper;
  gripper.times = {0.0};
  gripper.poses = {Eigen::Isometry3d(Eigen::Translation3d(0.55, 0.1, 0.171))};
  settings.gripper = gripper;
  const std::vector<RawView> views = {open_raw_view(folder("raw")), open_raw_view(folder("arm"))};
  EXPECT_LT(segment_folder(views, {0.0}, settings, folder("out")).frames[0].cloth.col(2).maxCoeff(), 0.172);
  settings.gripper.reset();
  EXPECT_GT(segment_folder(views, {0.0}, settings, folder("out2")).frames[0].cloth.col(2).maxCoeff(), 0.3);
}

/// A gripper 1 cm above the patch of each frame.
data::Trajectory above_patches(const std::vector<double>& heights) {
  data::Trajectory gripper;
  for (std::size_t k = 0; k < heights.size(); ++k) {
    gripper.times.push_back(0.1 * static_cast<double>(k));
    gripper.poses.emplace_back(Eigen::Translation3d(0.5, 0.1, 0.08 + heights[k]));
  }
  return gripper;
}

TEST_F(SegmentFolder, WhatIsKnownOfTheCellIsHandedOn) {
  write_depth_view(folder("raw"), {0.1, 0.2});
  SegmentFolderSettings settings;
  settings.gripper = above_patches({0.1, 0.2});
  segment_folder({open_raw_view(folder("raw"))}, {0.0, 0.1}, settings, folder("out"));
  const SegmentedCell cell = load_segmented_cell(folder("out") + "/segment.json");
  ASSERT_TRUE(cell.table);
  EXPECT_NEAR(height_under(*cell.table, camera_position), 0.07, 1e-6);
  EXPECT_EQ(cell.times, (std::vector<double>{0, 0.1}));
  ASSERT_EQ(cell.cameras.size(), 1u);
  EXPECT_TRUE(cell.cameras[0].isApprox(camera_position));
  EXPECT_TRUE(data::load_trajectory(cell.trajectory).poses[1].isApprox(settings.gripper->poses[1]));
}

TEST_F(SegmentFolder, OnePictureForAllFramesOfAMotionIsRefused) {
  write_depth_view(folder("raw"), {0.1, 0.1});
  SegmentFolderSettings settings;
  settings.gripper = above_patches({0.1, 0.2});
  const auto segmented = [&] {
    segment_folder({open_raw_view(folder("raw"))}, {0.0, 0.1}, settings, folder("out"));
  };
  EXPECT_NE(message_of(segmented).find("its frames are all alike, while the gripper moves by 0.1 m"),
            std::string::npos);
  settings.accept_fault = true;
  EXPECT_EQ(message_of(segmented), "no error");
}

TEST_F(SegmentFolder, CamerasAndGrippersOfOtherCellsAreRefusedAndTheMistakeIsNamed) {
  write_depth_view(folder("raw"), {0.1, 0.2, 0.3});
  SegmentFolderSettings settings;
  settings.gripper = above_patches({0.1, 0.2, 0.3});
  const RawView view = open_raw_view(folder("raw"));
  const std::vector<double> times = {0, 0.1, 0.2};
  const auto message_with = [&](const RawView& other) {
    return message_of([&] { segment_folder({other}, times, settings, folder("out")); });
  };
  EXPECT_EQ(message_with(view), "no error");

  RawView opengl = view;
  opengl.base_from_camera = view.base_from_camera * Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX());
  EXPECT_NE(message_with(opengl).find(
                "below the table that it sees. It would be one if the camera's axes are those "
                "of OpenGL"),
            std::string::npos)
      << message_with(opengl);
  RawView inverse = view;
  inverse.base_from_camera = view.base_from_camera.inverse();
  EXPECT_NE(message_with(inverse).find("the pose is that of the base in the camera"), std::string::npos)
      << message_with(inverse);

  RawView camera_in_millimetres = view;
  camera_in_millimetres.base_from_camera.translation() *= 1e3;
  EXPECT_NE(message_with(camera_in_millimetres).find("if the camera's position is in millimetres"),
            std::string::npos)
      << message_with(camera_in_millimetres);
  const data::Trajectory in_metres = *settings.gripper;
  for (Eigen::Isometry3d& pose : settings.gripper->poses) pose.translation() *= 1e3;
  EXPECT_NE(message_with(view).find("if the gripper's positions are in millimetres"), std::string::npos)
      << message_with(view);

  settings.gripper = in_metres;
  for (Eigen::Isometry3d& pose : settings.gripper->poses) pose.translation().x() += 0.6;
  EXPECT_NE(message_with(view).find("from the nearest point that is seen"), std::string::npos);
  EXPECT_FALSE(fs::exists(folder("other")));
  settings.accept_fault = true;
  EXPECT_NE(segment_folder({view}, times, settings, folder("other")).warnings.at(0).find("not of one cell"),
            std::string::npos);
}

TEST_F(SegmentFolder, AMistakeThatHidesTheTableIsNamedWhetherOneIsSoughtOrStated) {
  write_depth_view(folder("raw"), {0.1, 0.2, 0.3});
  SegmentFolderSettings settings;
  settings.gripper = above_patches({0.1, 0.2, 0.3});
  const RawView view = open_raw_view(folder("raw"));
  const auto message_with = [&](const RawView& other) {
    return message_of([&] { segment_folder({other}, {0, 0.1, 0.2}, settings, folder("out")); });
  };
  // Half a turn about x + y looks down too; its quaternion as w x y z makes the camera look along y.
  RawView other = view;
  other.base_from_camera.linear() =
      Eigen::Quaterniond(0, 0, std::sqrt(0.5), std::sqrt(0.5)).toRotationMatrix();
  const std::string quaternion = ". It would be one if the quaternion of the camera is w x y z";
  EXPECT_NE(message_with(other).find("no table that stands still is seen across the vertical" + quaternion),
            std::string::npos)
      << message_with(other);
  settings.table_height = 0.07;
  EXPECT_EQ(message_with(view), "no error");
  settings.gripper.reset();  // which would be far from what is seen
  EXPECT_NE(message_with(other).find("no plane is seen at --table-z 0.07" + quaternion), std::string::npos)
      << message_with(other);
  settings.table_height = -0.3;  // of a table that is not in view
  EXPECT_EQ(message_with(view), "no error");
}

TEST_F(SegmentFolder, AnotherDepthScaleIsNamedWhereItMakesACell) {
  write_depth_view(folder("raw"), {0.1, 0.2, 0.3});
  SegmentFolderSettings settings;
  settings.gripper = above_patches({0.1, 0.2, 0.3});
  for (const bool table : {true, false})
    for (const double scale : {1e-4, 2e-4, 2.5e-4, 1e-2}) {
      RawView view = open_raw_view(folder("raw"));
      view.depth_scale = scale;
      settings.table_height = table ? std::nullopt : std::optional(0.07);
      const std::string said = message_of([&] {
        segment_folder({view}, {0, 0.1, 0.2}, settings, folder("out"));
      });
      EXPECT_NE(said.find("It would be one if a count of the depth images is 0.001 m (--depth-scale 0.001)"),
                std::string::npos)
          << scale << ' ' << said;
    }
}

TEST_F(SegmentFolder, AFlangeForTheToolIsWarnedOf) {
  const std::vector<double> heights = {0.02, 0.06, 0.1};
  write_depth_view(folder("raw"), heights);
  SegmentFolderSettings settings;
  settings.gripper = above_patches(heights);
  const auto warnings = [&](const char* out) {
    return segment_folder({open_raw_view(folder("raw"))}, {0, 0.1, 0.2}, settings, folder(out)).warnings;
  };
  EXPECT_TRUE(warnings("tool").empty());
  for (Eigen::Isometry3d& pose : settings.gripper->poses) pose.translation().z() += 0.12;
  EXPECT_EQ(
      warnings("flange"),
      std::vector<std::string>{
          "trajectory: the gripper is never nearer to the table than 0.15 m: is it the flange, in place of "
          "the tool centre point? (or does the cloth hang from the start?)"});
}

TEST_F(SegmentFolder, AWallThatIsLargerThanTheClothIsNotTheCloth) {
  const std::vector<double> heights = {0.1, 0.15, 0.2, 0.25, 0.3};
  write_depth_view(folder("raw"), heights);
  fs::create_directories(folder("wall"));
  data::Points wall(120 * 60, 3);
  for (int i = 0; i < wall.rows(); ++i) wall.row(i) << 0.2 + 0.005 * (i % 120), 0.5, 0.1 + 0.005 * (i / 120);
  for (std::size_t k = 0; k < heights.size(); ++k)
    data::save_point_cloud(wall, folder("wall") + "/" + std::to_string(k) + ".ply");
  const std::vector<RawView> views = {open_raw_view(folder("raw")), open_raw_view(folder("wall"))};
  const std::vector<double> times = {0, 0.1, 0.2, 0.3, 0.4};
  SegmentFolderSettings settings;
  for (const bool gripper : {false, true}) {
    if (gripper) settings.gripper = above_patches(heights);
    const SegmentedFolder result =
        segment_folder(views, times, settings, folder(gripper ? "with" : "without"));
    for (const Segmentation& frame : result.frames) {
      ASSERT_GT(frame.cloth.rows(), 300) << gripper;
      EXPECT_LT(frame.cloth.col(1).maxCoeff(), 0.25) << gripper;
    }
  }
}

TEST_F(SegmentFolder, NumbersInNamesCount) {
  write_depth_view(folder("raw"), std::vector<double>(11, 0.1));
  const RawView view = open_raw_view(folder("raw"));
  EXPECT_TRUE(view.files[2].ends_with("/2.png")) << view.files[2];
  EXPECT_TRUE(view.files[10].ends_with("/10.png")) << view.files[10];
}

TEST_F(SegmentFolder, TheTableIsFoundWhereTheCropCutsItOff) {
  write_depth_view(folder("raw"), {0.1, 0.2});
  SegmentFolderSettings settings;
  settings.segment.crop.min.z() = 0.08;
  const SegmentedFolder result =
      segment_folder({open_raw_view(folder("raw"))}, {0.0, 0.1}, settings, folder("out"));
  EXPECT_NEAR(result.table->plane.point.z(), 0.07, 1e-6);
  EXPECT_EQ(result.table->agreeing, 2);
  EXPECT_TRUE(result.warnings.empty());
  EXPECT_GT(result.frames[0].cloth.rows(), 300);
}

TEST_F(SegmentFolder, ATableThatIsTiltedIsDoubted) {
  write_depth_view(folder("raw"), {0.1});
  // The camera's pose is off by 5 degrees about x.
  const double half = (180 - 5) * M_PI / 360;
  std::ofstream(folder("raw") + "/extrinsics.tum")
      << "0 0.5 0.1 1.07 " << std::sin(half) << " 0 0 " << std::cos(half);
  fs::remove(folder("raw") + "/extrinsics.json");
  const SegmentedFolder result = segment_folder({open_raw_view(folder("raw"))}, {0.0}, {}, folder("out"));
  ASSERT_EQ(result.warnings.size(), 1u);
  EXPECT_NE(result.warnings[0].find("tilted by 5.0 deg"), std::string::npos) << result.warnings[0];
}

TEST_F(SegmentFolder, FilesBesideTheViewCountInPlaceOfItsOwn) {
  write_depth_view(folder("raw"), {0.1});
  fs::rename(folder("raw") + "/camera_info.yaml", folder("lens.yaml"));
  fs::rename(folder("raw") + "/extrinsics.json", folder("pose.json"));
  data::MaskImage left{160, 120, std::vector<std::uint8_t>(160 * 120, 0)};
  for (int v = 0; v < 120; ++v)
    for (int u = 0; u < 80; ++u) left.at(u, v) = 255;
  data::save_mask(left, folder("masks") + "/0.png");
  RawViewFiles files;
  files.intrinsics = folder("lens.yaml");
  files.extrinsics = folder("pose.json");
  files.masks = folder("masks");
  files.depth_scale = 0.0005;
  SegmentFolderSettings settings;
  const SegmentedFolder result =
      segment_folder({open_raw_view(folder("raw"), files)}, {0.0}, settings, folder("out"));
  // Half as far away, and only half of it in the mask; the table, seen everywhere, is found all the same.
  EXPECT_NEAR(result.table->plane.point.z(), 1.07 - 0.5, 1e-6);
  EXPECT_NEAR(result.frames[0].cloth.col(2).mean(), 1.07 - 0.45, 1e-6);
  EXPECT_LT(result.frames[0].cloth.col(0).maxCoeff(), camera_position.x());
  settings.table_height = 0.6;
  EXPECT_EQ(segment_folder({open_raw_view(folder("raw"), files)}, {0.0}, settings, folder("out"))
                .table->plane.point.z(),
            0.6);
}

TEST_F(SegmentFolder, ATrajectoryOfAnotherClockIsRefusedAndNothingIsLeft) {
  write_depth_view(folder("raw"), {0.1, 0.2});
  SegmentFolderSettings settings;
  data::Trajectory gripper;
  gripper.times = {1764e6, 1764e6 + 1};
  gripper.poses.assign(2, Eigen::Isometry3d(Eigen::Translation3d(0.55, 0.1, 0.171)));
  settings.gripper = gripper;
  const std::vector<RawView> views = {open_raw_view(folder("raw"))};
  EXPECT_NE(message_of([&] {
              segment_folder(views, {0.0, 0.1}, settings, folder("a/out"));
            }).find("2 of 2 frames are outside of it"),
            std::string::npos);
  settings.gripper.reset();
  settings.segment.cluster_points = 1000000;
  EXPECT_NE(message_of([&] {
              segment_folder(views, {0.0, 0.1}, settings, folder("a/out"));
            }).find("no frame holds a cluster of 1000000 points"),
            std::string::npos);
  EXPECT_FALSE(fs::exists(folder("a")));
}

TEST_F(SegmentFolder, PointsThatAreNowhereAreCountedOrRefused) {
  write_depth_view(folder("raw"), {0.1});
  data::Points hole(2, 3);
  hole << 0.5, 0.1, 0.17, 0.5, 0.1, std::nan("");
  data::save_point_cloud(hole, folder("b") + "/000.ply");
  const std::vector<RawView> views = {open_raw_view(folder("raw")), open_raw_view(folder("b"))};
  const SegmentedFolder result = segment_folder(views, {0.0}, {}, folder("out"));
  ASSERT_EQ(result.warnings.size(), 1u);
  EXPECT_NE(result.warnings[0].find("1 points of the clouds are not finite"), std::string::npos);
  hole(1, 2) = 1e30;
  data::save_point_cloud(hole, folder("b") + "/000.ply");
  EXPECT_NE(message_of([&] { segment_folder(views, {0.0}, {}, folder("out")); }).find("more than 100 km"),
            std::string::npos);
}

TEST_F(SegmentFolder, WhatIsMissingIsNamed) {
  EXPECT_NE(message_of([&] { open_raw_view(folder("nowhere")); }).find("does not exist"), std::string::npos);
  fs::create_directories(folder("empty"));
  EXPECT_NE(message_of([&] { open_raw_view(folder("empty")); }).find("found neither clouds"),
            std::string::npos);
  write_depth_view(folder("raw"), {0.1, 0.2});
  const RawView view = open_raw_view(folder("raw"));
  EXPECT_NE(message_of([&] { segment_folder({view}, {0.0}, {}, folder("out")); }).find("found 2, expected 1"),
            std::string::npos);
  fs::remove(folder("raw") + "/extrinsics.json");
  EXPECT_NE(message_of([&] { open_raw_view(folder("raw")); }).find("need the pose of their camera"),
            std::string::npos);
}

TEST_F(SegmentFolder, ATableWithoutClothSaysSo) {
  write_depth_view(folder("raw"), {0.0});
  const RawView view = open_raw_view(folder("raw"));
  EXPECT_NE(
      message_of([&] { segment_folder({view}, {0.0}, {}, folder("out")); }).find("no frame holds a cluster"),
      std::string::npos);
}

}  // namespace
}  // namespace flash::sysid
