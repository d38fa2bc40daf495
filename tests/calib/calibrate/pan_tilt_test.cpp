#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cstdio>

#include "calib/calibrate/calibrate_images.h"
#include "calib/check/opencv_closed_forms.h"
#include "calib/detect/detect.h"
#include "calib/detect/read_depth.h"
#include "tests/calib/rendered_set.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

// Forty RGB-D pictures of a robot's head that pans and tilts before a board 0.8 m away: two axes that nearly
// meet, and no other motion.
TEST(PanTilt, FortyPicturesWithDepthAreSolvedAndTheWeakestDirectionIsNamed) {
  const data::TemporaryFolder folder;
  RenderedSetSettings settings{.views = 40};
  settings.width = 480;
  settings.height = 360;
  settings.robot_deg = 0.02;
  settings.robot_mm = 0.1;
  settings.motion = RobotMotion::pan_tilt;
  settings.depth_mm = 2;
  const HandEyePoses truth = write_rendered_set(settings, folder / "neck");
  const auto solved = [&](bool depth, double size_sd = kPrintSd) {
    const Dataset dataset = load_dataset(folder / "neck", {.depth = depth});
    const Target target = parse_target(dataset.target);
    DetectSettings detecting;
    detecting.cache = folder / "cache";
    CalibrateSettings solving;
    solving.target_size_sd = size_sd;
    solving.lens = LensKnowledge::stated;  // what it leaves open would hide what the head leaves open
    solving.closed_forms = opencv_closed_forms();
    const std::vector<Detection> detections = detect(dataset, target, detecting);
    return calibrate_images(*dataset.setup, dataset, target, detections, read_depth(dataset, detections),
                            solving);
  };
  const ImageCalibration rgbd = solved(true), rgb = solved(false);
  const Calibration& result = rgbd.calibration;
  const Vector6d error = motion_between(result.poses.X, truth.X);
  EXPECT_EQ(result.used.size(), 40U);
  EXPECT_TRUE(result.usable);
  ASSERT_TRUE(rgbd.depth && rgbd.depth->used);
  EXPECT_LT(error.dot(result.covariance.ldlt().solve(error)), 22.5);  // 99.9 % of chi-square, 6
  EXPECT_LT(result.diversity.spread[2], 0.2 * result.diversity.spread[1]);
  EXPECT_GT(result.diversity.spread[1], 0.1);
  // How the camera is turned about the pan axis, its own y, only the tilts tell, which are the smaller turns:
  // an error e shows as e times their sine, 0.17 / sqrt(2) rms, under the robot's noise of each view.
  const WeakestDirection weakest =
      weakest_direction(result.refined.covariance.topLeftCorner<6, 6>(), 0.8, "camera");
  EXPECT_TRUE(weakest.name.starts_with("rotation about")) << weakest.name;
  EXPECT_GT(weakest.direction.tail<3>().normalized().cwiseAbs().y(), 0.95) << weakest.name;
  const double expected = settings.robot_deg * M_PI / 180 / (0.17 / std::sqrt(2.0) * std::sqrt(40.0));
  // The noise level is itself known to 1 / sqrt(2 x 114 residuals), 7 %; three times that.
  EXPECT_NEAR(weakest.rotation, expected, 0.2 * expected);
  // The head turns and never moves along: nothing but the target says how long a metre is, so its size cannot
  // be checked against the robot. It can against depth.
  EXPECT_FALSE(result.size->wanted);
  EXPECT_FALSE(rgb.calibration.size->wanted);
  EXPECT_TRUE(rgb.calibration.usable);
  EXPECT_NE(data::input_error_of([&] {
              solved(false, std::numeric_limits<double>::infinity());
            }).find("do not tell the size"),
            std::string::npos);
  // Li's closed form is hundreds of pixels off along what only tilts tell.
  for (const ComparedMethod& method : result.comparison)
    EXPECT_EQ(method.wild, method.px > 100) << method.name << " " << method.px;
  // Depth is as long as the target's size is known.
  EXPECT_NEAR(rgbd.depth->over_corners_sd, kPrintSd, 0.1 * kPrintSd);
  EXPECT_NEAR(rgbd.depth->over_corners, 1, 4 * rgbd.depth->over_corners_sd);
  std::printf("%s: %.4f deg; off by %.2f mm, %.4f deg; depth %.5f +- %.5f\n", weakest.name.c_str(),
              weakest.rotation * 180 / M_PI, 1e3 * error.head<3>().norm(),
              error.tail<3>().norm() * 180 / M_PI, rgbd.depth->over_corners, rgbd.depth->over_corners_sd);
}

}  // namespace
}  // namespace flash::calib
