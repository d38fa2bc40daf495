#include "calib/dataset/lens_file.h"

#include <gtest/gtest.h>

#include "data/files/error.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

data::CameraIntrinsics camera() {
  return {.width = 640,
          .height = 480,
          .fx = 600,
          .fy = 601,
          .cx = 320,
          .cy = 240,
          .model = data::DistortionModel::plumb_bob,
          .distortion = {0.1, -0.2, 0.001, 0.002, 0.05}};
}

TEST(LensFile, CovarianceComesBackAsItWasWritten) {
  const data::TemporaryFolder folder;
  LensCovariance covariance = LensCovariance::Zero();
  covariance.topLeftCorner<9, 9>().setIdentity();
  covariance(0, 1) = covariance(1, 0) = 0.75;
  covariance(8, 8) = 1e-6;
  save_lens(camera(), covariance, folder / "camera_info.yaml");
  const std::optional<LensCovariance> read = load_lens_covariance(folder / "camera_info.yaml");
  ASSERT_TRUE(read);
  EXPECT_EQ(*read, covariance);
  EXPECT_EQ(data::load_camera_intrinsics(folder / "camera_info.yaml").distortion, camera().distortion);
}

TEST(LensFile, FileWithoutOneStatesNone) {
  const data::TemporaryFolder folder;
  data::save_camera_info(camera(), folder / "camera_info.yaml");
  EXPECT_FALSE(load_lens_covariance(folder / "camera_info.yaml"));
}

TEST(LensFile, WhatIsNoCovarianceIsRefused) {
  const data::TemporaryFolder folder;
  for (const char* data :
       {"[1, 2, 3]", "[1,0,0,0, 0,-1,0,0, 0,0,1,0, 0,0,0,1]", "[1,2,0,0, 2,1,0,0, 0,0,1,0, 0,0,0,1]",
        "[1,0.5,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]"}) {
    folder.write("camera_info.yaml",
                 std::string("intrinsics_covariance: {rows: 4, cols: 4, data: ") + data + "}\n");
    const std::string message =
        data::input_error_of([&] { load_lens_covariance(folder / "camera_info.yaml"); });
    EXPECT_NE(message.find("intrinsics_covariance"), std::string::npos) << data << ": " << message;
  }
}

}  // namespace
}  // namespace flash::calib
