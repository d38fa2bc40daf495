#include "calib/solve/time_offset.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>

#include "calib/calibrate/calibrate_images.h"
#include "calib/detect/detect.h"
#include "calib/geometry/projection.h"
#include "tests/calib/hand_eye_scene.h"
#include "tests/calib/rendered_set.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

/// A twist of constant velocity in the gripper's own frame.
data::Trajectory screw(const Vector6d& velocity, double rate, double duration) {
  data::Trajectory stream;
  Eigen::Isometry3d pose = make_pose({0.3, 0.1, 0.5}, {0.2, 1, -0.5});
  constexpr int kSubsteps = 100;
  for (int i = 0; i < static_cast<int>(rate * duration); ++i) {
    stream.times.push_back(i / rate);
    stream.poses.push_back(pose);
    for (int k = 0; k < kSubsteps; ++k) pose = moved(pose, velocity / (rate * kSubsteps));
  }
  return stream;
}

TEST(MotionAt, VelocityIsThatOfTheGripperInItsFrame) {
  Vector6d velocity;
  velocity << 0.1, -0.2, 0.05, 0.5, -0.3, 0.8;
  const data::Trajectory stream = screw(velocity, 100, 1);
  const std::optional<Motion> motion = motion_at(stream, 0.503);
  ASSERT_TRUE(motion);
  // A turn of 1 rad/s over 50 ms bends the path by its square over six.
  EXPECT_LT((motion->velocity - velocity).norm(), 1e-3 * velocity.norm());
  // Constant in the gripper's frame: the pose 30 ms on is the pose moved by the velocity, to second order.
  const Vector6d error =
      motion_between(moved(motion->pose, 0.03 * motion->velocity), motion_at(stream, 0.533)->pose);
  EXPECT_LT(error.norm(), 0.5 * 0.03 * 0.03);
  EXPECT_FALSE(motion_at(stream, 0.02));  // half a window before the first pose
  EXPECT_FALSE(motion_at(stream, 0.98));  // or after the last
  data::Trajectory gap = stream;
  gap.times.erase(gap.times.begin() + 20, gap.times.begin() + 80);
  gap.poses.erase(gap.poses.begin() + 20, gap.poses.begin() + 80);
  EXPECT_FALSE(motion_at(gap, 0.5));
}

/// A stream and what a camera saw along it, pictures later than their stamps by `offset`.
struct StreamScene {
  Dataset dataset;
  Target target = parse_target("chessboard:9x6:0.025");
  std::vector<Detection> detections;
  HandEyePoses truth;

  StreamScene(double offset, unsigned seed, double speed = 1, double corner_px = 0.1, double robot_mm = 0.2) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> phase(0, 2 * M_PI);
    const Eigen::Matrix3Xd points = target_points(target);
    data::CameraIntrinsics camera = HandEyeScene().camera;
    truth = {make_pose({0.05, 0.02, 0.08}, {0.3, -0.2, 0.4}), make_pose({0.6, 0.1, 0.3}, {1.2, -2.0, 0.5})};
    std::vector<double> p;
    for (int i = 0; i < 6; ++i) p.push_back(phase(random));
    const Eigen::Isometry3d to_middle = make_pose(points.rowwise().mean(), Eigen::Vector3d::Zero());
    const auto target_at = [&](double t) {
      return make_pose({0.04 * std::sin(1.7 * speed * t + p[0]), 0.03 * std::sin(1.5 * speed * t + p[1]),
                        0.45 + 0.06 * std::sin(1.1 * speed * t + p[2])},
                       {0.5 * std::sin(1.3 * speed * t + p[3]), 0.45 * std::sin(0.9 * speed * t + p[4]),
                        0.6 * std::sin(0.7 * speed * t + p[5])}) *
             to_middle.inverse();
    };
    dataset.source = "stream";
    dataset.poses_path = "poses.tum";
    dataset.camera = camera;
    data::Trajectory stream;
    for (int k = 0; k < 1200; ++k) {
      Vector6d error;
      for (int i = 0; i < 6; ++i) error[i] = normal(random) * (i < 3 ? 1e-3 * robot_mm : 2e-4);
      stream.times.push_back(0.01 * k);
      stream.poses.push_back(moved(truth.Z * target_at(0.01 * k).inverse() * truth.X.inverse(), error));
    }
    for (int i = 0; i < 25; ++i) {
      Frame frame;
      frame.stamp = 0.6 + 0.43 * i;
      frame.name = std::to_string(i) + ".png";
      frame.T_base_gripper = data::pose_at(stream, frame.stamp);
      const Eigen::Isometry3d T = target_at(frame.stamp + offset);
      Observation view;
      view.image = frame.name;
      view.T_base_gripper = frame.T_base_gripper;
      view.pixels.resize(2, points.cols());
      for (Eigen::Index k = 0; k < points.cols(); ++k) {
        view.points.push_back(static_cast<int>(k));
        view.pixels.col(k) = project(to_vector(camera), T * points.col(k)) +
                             corner_px * Eigen::Vector2d(normal(random), normal(random));
      }
      view.T_camera_target = {fitted_pose(camera, points, view.pixels, T)};
      detections.push_back({frame.name, "", {{"image_model", view}}});
      dataset.frames.push_back(std::move(frame));
    }
    dataset.stream = std::move(stream);
  }

  ImageCalibration solved(ClockOffset clock_offset = ClockOffset::where_it_matters) const {
    CalibrateSettings settings;
    settings.folds = 2;
    settings.clock_offset = clock_offset;
    return calibrate_images(Setup::eye_in_hand, dataset, target, detections, std::nullopt, settings);
  }
};

TEST(TimeOffset, IsFoundWithinItsStandardDeviation) {
  constexpr int kTrials = 8;
  double squares = 0;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    const StreamScene scene(0.03, 10 + trial);
    const ImageCalibration result = scene.solved();
    ASSERT_TRUE(result.time_offset);
    EXPECT_LT(result.time_offset->sd, 1e-3);
    squares += std::pow((result.time_offset->estimate - 0.03) / result.time_offset->sd, 2);
    const Vector6d error = motion_between(result.calibration.poses.X, scene.truth.X);
    const Vector6d sd = result.calibration.covariance.diagonal().cwiseSqrt();
    EXPECT_TRUE((error.cwiseAbs().array() < 4.5 * sd.array()).all())
        << error.transpose() << " / " << sd.transpose();
  }
  std::printf("8 streams: normalised error squared %.2f\n", squares / kTrials);
  // Chi-square of 8 degrees of freedom, 99.8 %.
  EXPECT_GT(squares, 0.86);
  EXPECT_LT(squares, 26.1);
}

TEST(TimeOffset, LargeOnesAreFoundToo) {
  for (const double offset : {-0.2, 0.15, 0.26}) {
    const ImageCalibration result = StreamScene(offset, 3).solved();
    ASSERT_TRUE(result.time_offset);
    EXPECT_NEAR(result.time_offset->estimate, offset, 4.5 * result.time_offset->sd);
    EXPECT_EQ(result.calibration.used.size(), 25U);
  }
}

TEST(TimeOffset, UnaskedForItIsWarnedOf) {
  const ImageCalibration late = StreamScene(0.03, 4).solved(ClockOffset::none),
                         right = StreamScene(0, 4).solved(ClockOffset::none);
  EXPECT_FALSE(late.time_offset);
  ASSERT_FALSE(late.calibration.warnings.empty());
  EXPECT_NE(late.calibration.warnings.front().find("--no-time-offset"), std::string::npos);
  for (const std::string& warning : right.calibration.warnings)
    EXPECT_EQ(warning.find("--no-time-offset"), std::string::npos) << warning;
}

// A robot moves by centimetres in a tenth of a second: an answer that leaves it out must not be used, and the
// robot's noise is no second cause.
TEST(TimeOffset, ThatTheAnswerDependsOnLeavesNone) {
  const StreamScene scene(0.1, 4);
  const Calibration late = scene.solved(ClockOffset::none).calibration;
  EXPECT_FALSE(late.usable);
  int named = 0;
  for (const std::string& warning : late.warnings) {
    named += warning.find("--no-time-offset") != std::string::npos;
    EXPECT_EQ(warning.find("two tools"), std::string::npos) << warning;
  }
  EXPECT_EQ(named, 1);
  EXPECT_NE(late.warnings.front().find("--no-time-offset"), std::string::npos) << late.warnings.front();
  EXPECT_TRUE(scene.solved().calibration.usable);
  EXPECT_TRUE(StreamScene(0, 4).solved(ClockOffset::none).calibration.usable);
}

TEST(TimeOffset, IsRefusedWithoutAStreamAndOfARobotAtRest) {
  StreamScene scene(0.03, 5);
  scene.dataset.stream.reset();
  EXPECT_NE(data::input_error_of([&] {
              scene.solved(ClockOffset::solved);
            }).find("expected a stream of poses over time"),
            std::string::npos);
  // Stands where each picture was taken, and jumps in between.
  StreamScene standing(0, 6);
  data::Trajectory& stream = *standing.dataset.stream;
  for (std::size_t k = 0; k < stream.times.size(); ++k) {
    const auto nearest =
        static_cast<std::size_t>(std::clamp(std::lround((stream.times[k] - 0.6) / 0.43), 0L, 24L));
    stream.poses[k] = standing.dataset.frames[nearest].T_base_gripper;
  }
  EXPECT_NE(data::input_error_of([&] {
              standing.solved(ClockOffset::solved);
            }).find("stands still at every picture"),
            std::string::npos);
}

TEST(TimeOffset, OfARenderedStreamIsFound) {
  const data::TemporaryFolder folder;
  RenderedSetSettings settings{.views = 16};
  settings.width = 480;
  settings.height = 360;
  settings.robot_deg = 0.01;
  settings.robot_mm = 0.1;
  settings.motion = RobotMotion::stream;
  settings.time_offset = 0.03;
  const HandEyePoses truth = write_rendered_set(settings, folder / "stream");
  const Dataset dataset = load_dataset(folder / "stream");
  const Target target = parse_target(dataset.target);
  const ImageCalibration result =
      calibrate_images(*dataset.setup, dataset, target, detect(dataset, target), std::nullopt);
  ASSERT_TRUE(result.time_offset);
  const Vector6d error = motion_between(result.calibration.poses.X, truth.X);
  std::printf("offset %.2f +- %.2f ms; off by %.3f mm\n", 1e3 * result.time_offset->estimate,
              1e3 * result.time_offset->sd, 1e3 * error.head<3>().norm());
  EXPECT_NEAR(result.time_offset->estimate, 0.03, 4 * result.time_offset->sd);
  EXPECT_LT(result.time_offset->sd, 1e-3);
  const Vector6d sd = result.calibration.covariance.diagonal().cwiseSqrt();
  EXPECT_TRUE((error.cwiseAbs().array() < 4.5 * sd.array()).all())
      << error.transpose() << " / " << sd.transpose();
}

}  // namespace
}  // namespace flash::calib
