#include "data/camera/camera.h"

#include <gtest/gtest.h>

#include "data/camera/depth_map.h"
#include "data/files/atomic_file.h"
#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

CameraIntrinsics wide_camera() {
  CameraIntrinsics camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = 610.5;
  camera.fy = 612.25;
  camera.cx = 318.125;
  camera.cy = 242.5;
  camera.model = DistortionModel::plumb_bob;
  camera.distortion = {-0.28, 0.09, 0.001, -0.0007, -0.012};
  return camera;
}

TEST(Camera, UnprojectInvertsProject) {
  CameraIntrinsics camera = wide_camera();
  for (const DistortionModel model :
       {DistortionModel::none, DistortionModel::plumb_bob, DistortionModel::rational_polynomial}) {
    camera.model = model;
    camera.distortion.resize(model == DistortionModel::rational_polynomial ? 8 : 5, 0.02);
    for (const Eigen::Vector2d& pixel :
         {Eigen::Vector2d(0, 0), {639, 479}, {0, 479}, {320, 240}, {500.5, 17.25}}) {
      const Eigen::Vector3d point = unproject(camera, pixel, 1.7);
      EXPECT_DOUBLE_EQ(point.z(), 1.7);
      EXPECT_LT((*project(camera, point) - pixel).norm(),
                1e-9);  // Newton to 1e-14 in normalised units, times f
    }
  }
  EXPECT_FALSE(project(camera, {0, 0, -1}));
}

TEST(Camera, ProjectionFollowsTheBrownModel) {
  const CameraIntrinsics camera = wide_camera();
  // The formula written out, term by term, for one point.
  const double x = 0.3, y = -0.2, r2 = 0.13;
  const double radial = 1 - 0.28 * r2 + 0.09 * r2 * r2 - 0.012 * r2 * r2 * r2;
  const double u = x * radial + 2 * 0.001 * x * y - 0.0007 * (r2 + 2 * x * x);
  const double v = y * radial + 0.001 * (r2 + 2 * y * y) - 2 * 0.0007 * x * y;
  const Eigen::Vector2d pixel = *project(camera, {0.6, -0.4, 2});
  EXPECT_NEAR(pixel.x(), 610.5 * u + 318.125, 1e-10);
  EXPECT_NEAR(pixel.y(), 612.25 * v + 242.5, 1e-10);
}

TEST(Camera, SurvivesSaveAndLoad) {
  const TemporaryFolder folder;
  const CameraIntrinsics written = wide_camera();
  save_camera_info(written, folder / "camera_info.yaml");
  const CameraIntrinsics read = load_camera_intrinsics(folder / "camera_info.yaml");
  EXPECT_EQ(read.width, written.width);
  EXPECT_EQ(read.height, written.height);
  EXPECT_EQ(read.fx, written.fx);
  EXPECT_EQ(read.fy, written.fy);
  EXPECT_EQ(read.cx, written.cx);
  EXPECT_EQ(read.cy, written.cy);
  EXPECT_EQ(read.model, written.model);
  EXPECT_EQ(read.distortion, written.distortion);
}

const char* const kOpenCv = R"(%YAML:1.0
---
calibration_time: "Mon 01 Jan 2024"
image_width: 1280
image_height: 720
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 9.0e+02, 0., 640.5, 0., 901., 360.5, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ 1.0e-01, -2.0e-01, 0., 0., 5.0e-02 ]
)";

TEST(Camera, ReadsOpenCvYaml) {
  const TemporaryFolder folder;
  const CameraIntrinsics camera = load_camera_intrinsics(folder.write("calibration.yml", kOpenCv));
  EXPECT_EQ(camera.width, 1280);
  EXPECT_EQ(camera.fy, 901);
  EXPECT_EQ(camera.cx, 640.5);
  EXPECT_EQ(camera.model, DistortionModel::plumb_bob);
  EXPECT_EQ(camera.distortion, (std::vector<double>{0.1, -0.2, 0, 0, 0.05}));
}

TEST(Camera, MalformedFilesNameTheField) {
  const TemporaryFolder folder;
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = kOpenCv;
    text.replace(text.find(from), from.size(), to);
    const std::string path = folder.write("c.yml", text);
    const std::string message = input_error_of([&] { load_camera_intrinsics(path); });
    return message.starts_with(path) ? message.substr(path.size() + 2) : message;
  };
  EXPECT_EQ(changed("image_width: 1280", "width: 1280"), "image_width: missing, expected a number of pixels");
  EXPECT_EQ(changed("1280", "wide"), "image_width: found \"wide\", expected a number of pixels");
  EXPECT_EQ(changed("camera_matrix", "matrix"), "camera_matrix: missing, expected {rows, cols, data: [...]}");
  EXPECT_EQ(changed("9.0e+02, 0.", "900, 1.5"), "camera_matrix: found skew 1.5, expected 0");
  EXPECT_EQ(changed("0., 0., 1. ]", "0., 0. ]"), "camera_matrix: expected 3 x 3: fx 0 cx, 0 fy cy, 0 0 1");
  EXPECT_EQ(changed("9.0e+02, 0.", "-900, 0."),
            "camera_matrix: found a focal length of -900, expected one above 0");
  EXPECT_EQ(changed("rows: 3", "rows: 4"),
            "camera_matrix: found 9 numbers, expected as many as rows times cols");
  EXPECT_EQ(changed("1.0e-01", ".nan"), "distortion_coefficients: expected finite numbers in its data");
  EXPECT_EQ(changed("image_height: 720", "image_height: 720\ndistortion_model: equidistant"),
            "distortion_model: found \"equidistant\", expected plumb_bob, rational_polynomial or none");
  EXPECT_NE(changed("data: [ 9.0e+02,", "data: [ [").find("not valid YAML: line"), std::string::npos);
}

TEST(Camera, ReadsTheHandEyeCameras) {
  const std::string folder = std::string(FLASH_SHARED_DIR) + "/data/handeye";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is absent";
  int cameras = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().filename() != "camera_info.yaml") continue;
    const CameraIntrinsics camera = load_camera_intrinsics(entry.path().string());
    EXPECT_GT(camera.fx, 100) << entry.path();
    ++cameras;
  }
  EXPECT_GE(cameras, 8);
}

TEST(DepthImage, SixteenBitsSurvive) {
  const TemporaryFolder folder;
  DepthImage depth{5, 3, {}};
  for (int i = 0; i < 15; ++i) depth.pixels.push_back(static_cast<std::uint16_t>(4369 * i));
  save_depth_image(depth, folder / "d.png");
  const DepthImage read = load_depth_image(folder / "d.png");
  EXPECT_EQ(read.width, 5);
  EXPECT_EQ(read.height, 3);
  EXPECT_EQ(read.pixels, depth.pixels);

  MaskImage mask{5, 3, std::vector<std::uint8_t>(15, 0)};
  mask.at(2, 1) = 255;
  save_mask(mask, folder / "m.png");
  EXPECT_EQ(load_mask(folder / "m.png").pixels, mask.pixels);
  EXPECT_NE(input_error_of([&] {
              load_depth_image(folder / "m.png");
            }).find("found 8 bits in 1 channels, expected 16-bit grey depth"),
            std::string::npos);
}

TEST(DepthImage, BrokenFilesAreErrors) {
  const TemporaryFolder folder;
  EXPECT_NE(input_error_of([&] { load_mask(folder.write("x.png", "JFIF")); }).find("not a PNG file"),
            std::string::npos);
  save_mask({40, 30, std::vector<std::uint8_t>(1200, 9)}, folder / "m.png");
  std::ifstream stream(folder / "m.png", std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  for (std::size_t size = 8; size + 20 < bytes.size(); size += 5)
    EXPECT_NE(input_error_of([&] { load_mask(folder.write("cut.png", bytes.substr(0, size))); }), "") << size;
}

TEST(DepthImage, APictureThatUnpacksToTooMuchIsRefusedByItsHeader) {
  const TemporaryFolder folder;
  save_mask({4, 3, std::vector<std::uint8_t>(12, 9)}, folder / "m.png");
  std::string bytes = read_file(folder / "m.png");
  const auto sized = [&](std::uint8_t width_byte, std::uint8_t height_byte) {
    bytes[18] = static_cast<char>(width_byte);  // the width is 256 times this, and 4
    bytes[22] = static_cast<char>(height_byte);
    const std::string path = folder.write("x.png", bytes);
    return input_error_of([&] { load_mask(path); }).substr(path.size());
  };
  EXPECT_EQ(sized(64, 64), ": found 16,388 x 16,387 pixels, expected at most 268,435,456 in all");
  EXPECT_NE(sized(1, 1).find("PNG cannot be decoded"), std::string::npos);  // the header's sum is wrong
}

TEST(DepthImage, ACameraThatSeesNothingNearIsRefused) {
  CameraIntrinsics camera;
  camera.width = 4;
  camera.height = 3;
  camera.cx = 1.5;
  camera.cy = 1;
  const DepthImage depth{4, 3, std::vector<std::uint16_t>(12, 1000)};
  camera.fx = camera.fy = 1e-300;
  EXPECT_EQ(
      input_error_of([&] { points_from_depth(in_metres(depth, 0.001), {}, camera, "d.png"); }),
      "d.png: 12 of 12 pixels become points more than 100 km away, or none: check the camera's matrix and "
      "distortion, and the depth scale");
  camera.fx = camera.fy = 5;
  EXPECT_EQ(points_from_depth(in_metres(depth, 0.001), {}, camera, "d.png").rows(), 12);
}

TEST(DepthImage, PointsLieWhereTheirPixelsLook) {
  CameraIntrinsics camera = wide_camera();
  camera.width = 4;
  camera.height = 3;
  camera.cx = 1.5;
  camera.cy = 1;
  DepthImage depth{4, 3, std::vector<std::uint16_t>(12, 0)};
  depth.at(2, 1) = 1500;
  depth.at(3, 0) = 800;
  MaskImage mask{4, 3, std::vector<std::uint8_t>(12, 0)};
  EXPECT_EQ(points_from_depth(in_metres(depth, 0.001), {}, camera, "d.png").rows(), 2);
  mask.at(2, 1) = 1;
  const Points points = points_from_depth(in_metres(depth, 0.001), mask, camera, "d.png");
  ASSERT_EQ(points.rows(), 1);
  EXPECT_DOUBLE_EQ(points(0, 2), 1.5);
  EXPECT_LT((*project(camera, points.row(0)) - Eigen::Vector2d(2, 1)).norm(), 1e-9);
  camera.width = 5;
  EXPECT_EQ(input_error_of([&] { points_from_depth(in_metres(depth, 0.001), mask, camera, "d.png"); }),
            "d.png: found 4 x 3 pixels, expected the camera's 5 x 3");
}

}  // namespace
}  // namespace flash::data
