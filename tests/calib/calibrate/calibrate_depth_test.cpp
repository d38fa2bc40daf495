#include "calib/detect/read_depth.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cstdio>
#include <map>

#include "calib/calibrate/calibrate_images.h"
#include "calib/detect/detect.h"
#include "calib/solve/linearization.h"
#include "data/camera/depth_image.h"
#include "tests/calib/hand_eye_scene.h"
#include "tests/calib/rendered_set.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

double chi_square(const Vector6d& error, const Eigen::MatrixXd& covariance) {
  return error.dot(Matrix6d(covariance.topLeftCorner<6, 6>()).ldlt().solve(error));
}
double chi_square(const Calibration& result, const HandEyePoses& truth) {
  return chi_square(motion_between(result.poses.X, truth.X), result.covariance);
}

/// A tag of 60 mm about a metre away, of which corners alone tell distance and tilt badly; three depths a
/// view, as board_depth gives them.
HandEyeScene scene_with_depth(unsigned seed, double depth_noise) {
  SceneSettings settings = protocol_settings(Setup::eye_to_hand);
  settings.robot_deg = 0.02;
  settings.robot_mm = 0.2;
  HandEyeScene scene = make_scene(settings, tag_points(0.06), seed);
  std::mt19937 random(1000 + seed);
  std::normal_distribution<double> normal(0, depth_noise);
  for (std::size_t i = 0; i < scene.observations.size(); ++i) {
    const Eigen::Isometry3d T = scene.truth.X.inverse() * scene.true_poses[i] * scene.truth.Z;
    Eigen::Matrix3Xd& points = scene.observations[i].depth_points;
    points.resize(3, 3);
    for (int k = 0; k < 3; ++k) {
      const double angle = 2 * M_PI * k / 3;
      const Eigen::Vector3d P = T * (0.024 * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0));
      points.col(k) = P * (1 + normal(random) / P.z());
    }
  }
  return scene;
}

TEST(DepthInTheBundle, StatedUncertaintyIsTrueAndSmaller) {
  constexpr int kTrials = 30;
  constexpr double kNoise = 5e-4;  // [m]
  double with = 0, without = 0, squares = 0, squares_without = 0, noise = 0;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    HandEyeScene scene = scene_with_depth(100 + trial, kNoise);
    const std::vector<Symmetry> symmetries = {grid_symmetries(scene.points).front()};
    const HandEyePoses seed = shah(loops_of(scene));
    const auto solved = [&] {
      return refine(make_bundle(scene.settings.setup, scene.camera, scene.points, scene.observations, seed));
    };
    const Refinement rgbd = solved();
    for (Observation& o : scene.observations) o.depth_points.resize(3, 0);
    const Refinement rgb = solved();
    const auto error = [&](const Refinement& refined) {
      return motion_between(refined.bundle.cameras.front(), scene.truth.X);
    };
    with += chi_square(error(rgbd), rgbd.covariance) / kTrials;
    without += chi_square(error(rgb), rgb.covariance) / kTrials;
    squares += error(rgbd).head<3>().squaredNorm();
    squares_without += error(rgb).head<3>().squaredNorm();
    noise += rgbd.noise.depth.front() / kTrials;
  }
  std::printf("30 trials: %.2f mm rms with depth, %.2f without; NEES %.2f, %.2f; depth noise %.3f mm\n",
              1e3 * std::sqrt(squares / kTrials), 1e3 * std::sqrt(squares_without / kTrials), with, without,
              1e3 * noise);
  // 180 degrees of freedom over 30: 99.9 % lie in 4.1 to 8.3.
  EXPECT_GT(with, 4.1);
  EXPECT_LT(with, 8.3);
  EXPECT_LT(squares, squares_without);
  EXPECT_NEAR(noise, kNoise, 0.05 * kNoise);  // 30 x 60 residuals, less what corners leave open: 2 to 3 %
}

// The residual is z / s minus the distance predicted: its derivative with respect to the scale s is -z / s^2.
TEST(DepthInTheBundle, ScaleOfTheDepthHasItsDerivative) {
  const HandEyeScene scene = scene_with_depth(1, 5e-4);
  Bundle bundle =
      make_bundle(scene.settings.setup, scene.camera, scene.points, scene.observations, scene.truth);
  bundle.depth_scales = {1.3};
  const NoiseLevels noise = uniform_noise(bundle, 1, 1, 1, 1);
  const Unknowns unknowns;
  const LinearModel model = linearize(bundle, noise, {.unknowns = unknowns, .huber = 0});
  const int column = shared_columns(bundle, unknowns).depth_scales.front();
  ASSERT_GE(column, 0);
  int blocks = 0;
  for (const GramBlock& block : model.blocks) {
    if (block.component != 1) continue;  // depth of the one camera
    const Eigen::Matrix3Xd& points = bundle.views[static_cast<std::size_t>(block.group)].depth_points;
    EXPECT_NEAR(block.gram(model.own + column, model.own + column),
                (points.row(2) / (1.3 * 1.3)).squaredNorm(), 1e-12);
    // Times the residual: 0.3 / 1.3 of the distance too near.
    EXPECT_NEAR(block.gram(model.own + column, model.own + model.shared),
                (points.row(2) / (1.3 * 1.3)).dot((1 - 1 / 1.3) * points.row(2)), 0.01);
    ++blocks;
  }
  EXPECT_EQ(blocks, static_cast<int>(scene.observations.size()));
}

TEST(DepthInTheBundle, AnotherMetreMovesNothing) {
  HandEyeScene scene = scene_with_depth(2, 5e-4);
  const auto solved = [&] {
    return refine(
        make_bundle(scene.settings.setup, scene.camera, scene.points, scene.observations, scene.truth));
  };
  const Refinement right = solved();
  for (Observation& o : scene.observations) o.depth_points *= 1.015;
  const Refinement other = solved();
  EXPECT_NEAR(other.bundle.depth_scales.front() / right.bundle.depth_scales.front(), 1.015, 1e-5);
  EXPECT_LT(motion_between(right.bundle.cameras.front(), other.bundle.cameras.front()).norm(), 1e-5);
}

/// A tag of 60 mm seen by a noisy RGB-D camera at 0.6 to 1 m, a robot of 0.02 deg and 0.2 mm.
RenderedSetSettings tag_settings() {
  RenderedSetSettings settings{.setup = Setup::eye_to_hand, .target = "apriltag:36h11:0:0.06", .views = 14};
  settings.width = 640;
  settings.height = 480;
  settings.robot_deg = 0.02;
  settings.robot_mm = 0.2;
  settings.least_distance = 0.6;
  settings.most_distance = 1.0;
  settings.pixel_noise = 12;
  settings.depth_mm = 2;
  return settings;
}

/// Rendered once for all tests.
class RenderedDepth : public testing::Test {
 protected:
  void SetUp() override {
    if (folder_) return;
    folder_ = new data::TemporaryFolder();
    truth_ = write_rendered_set(tag_settings(), *folder_ / "set");
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }

  static ImageCalibration solved(
      const DatasetOptions& options, const std::function<void(Dataset&)>& change = [](Dataset&) {}) {
    Dataset dataset = load_dataset(*folder_ / "set", options);
    const Target target = parse_target(dataset.target);
    DetectSettings settings;
    settings.cache = *folder_ / "cache";
    const std::vector<Detection> detections = detect(dataset, target, settings);
    change(dataset);
    return calibrate_images(*dataset.setup, dataset, target, detections, read_depth(dataset, detections));
  }

  static data::TemporaryFolder* folder_;
  static HandEyePoses truth_;
};
data::TemporaryFolder* RenderedDepth::folder_ = nullptr;
HandEyePoses RenderedDepth::truth_;

TEST_F(RenderedDepth, PicturesWithDepthGiveABetterAnswerThatIsTrue) {
  const ImageCalibration rgbd = solved({}), rgb = solved({.depth = false});
  ASSERT_TRUE(rgbd.depth);
  EXPECT_FALSE(rgb.depth);
  EXPECT_TRUE(rgbd.depth->used) << rgbd.depth->reason;
  EXPECT_EQ(rgbd.depth->views, 14);
  EXPECT_NEAR(rgbd.depth->over_corners, 1, 5 * rgbd.depth->over_corners_sd);
  // 2 mm of noise and the rounding to millimetres.
  EXPECT_NEAR(rgbd.depth->pixel_noise, std::hypot(2e-3, 1e-3 / std::sqrt(12.0)), 4e-5);
  EXPECT_LT(chi_square(rgbd.calibration, truth_), 22.5);  // 99.9 % of chi-square, 6
  EXPECT_LT(chi_square(rgb.calibration, truth_), 22.5);
  const auto sd = [](const Calibration& c) { return std::sqrt(c.covariance.topLeftCorner<3, 3>().trace()); };
  const auto error = [&](const Calibration& c) {
    return motion_between(c.poses.X, truth_.X).head<3>().norm();
  };
  std::printf(
      "tag: off by %.2f mm with depth, %.2f without; stated %.2f, %.2f; plane %.3f mm, pixel %.2f mm\n",
      1e3 * error(rgbd.calibration), 1e3 * error(rgb.calibration), 1e3 * sd(rgbd.calibration),
      1e3 * sd(rgb.calibration), 1e3 * rgbd.depth->sigma, 1e3 * rgbd.depth->pixel_noise);
  EXPECT_LT(sd(rgbd.calibration), 0.8 * sd(rgb.calibration));
  EXPECT_LT(error(rgbd.calibration), error(rgb.calibration));
}

TEST_F(RenderedDepth, AnotherUnitIsRefusedAndAnotherScaleIsEstimated) {
  const std::string message = data::input_error_of([&] { solved({.depth_scale = 0.01}); });
  EXPECT_NE(message.find("expected --depth-scale 0.001 instead of 0.01"), std::string::npos) << message;
  const ImageCalibration other = solved({.depth_scale = 0.00102});
  ASSERT_TRUE(other.depth && other.depth->used);
  EXPECT_NEAR(other.depth->over_corners, 1.02, 4 * other.depth->over_corners_sd);
  EXPECT_NE(other.calibration.warnings.back().find("depth puts the target at 1.0"), std::string::npos);
  // A depth camera whose metre is 2 % long moves nothing: all of it goes into its scale.
  const ImageCalibration right = solved({});
  EXPECT_LT(motion_between(other.calibration.poses.X, right.calibration.poses.X).head<3>().norm(),
            0.02 * std::sqrt(right.calibration.covariance.topLeftCorner<3, 3>().trace()));
}

TEST_F(RenderedDepth, ViewsWhoseDepthCannotBeReadDoWithout) {
  const std::string broken = folder_->write("broken.png", "no picture");
  const ImageCalibration result = solved({}, [&](Dataset& dataset) {
    dataset.frames[2].depth = broken;
    dataset.frames[5].depth.clear();
  });
  ASSERT_TRUE(result.depth);
  EXPECT_TRUE(result.depth->used);
  EXPECT_EQ(result.depth->views, 12);
  EXPECT_EQ(result.calibration.used.size(), 14U);
  EXPECT_NE(result.calibration.warnings.back().find("broken.png"), std::string::npos);
}

}  // namespace
}  // namespace flash::calib
