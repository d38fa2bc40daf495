#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "calib/calibrate/calibrate.h"
#include "calib/calibrate/extrinsics.h"
#include "calib/check/cloud_check.h"
#include "calib/check/projection_check.h"
#include "calib/detect/finder.h"
#include "calib/geometry/planar_pose.h"
#include "tests/calib/rendered_view.h"

namespace flash::calib {
namespace {

/// An exact robot before a rendered target.
struct RenderedSet {
  Setup setup;
  Target target;
  data::CameraIntrinsics camera;
  HandEyePoses truth;
  std::vector<Observation> observations;
  std::vector<Eigen::Isometry3d> true_poses;  ///< T_camera_target
  std::vector<GreyImage> images;
};

Eigen::Isometry3d pose(const Eigen::Vector3d& translation, const Eigen::Vector3d& turn) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = translation;
  T.linear() = rotation_exp(turn);
  return T;
}

RenderedSet render(Setup setup, const std::string& target, const data::CameraIntrinsics& camera, int views,
                   double least_distance, double most_distance, double tilt) {
  RenderedSet set{setup, parse_target(target), camera, {}, {}, {}, {}};
  const Eigen::Isometry3d in_gripper = pose({0.05, 0.02, 0.08}, {0.3, -0.2, 0.4});
  const Eigen::Isometry3d in_world = pose({0.6, 0.1, 0.3}, {1.2, -2.0, 0.5});
  set.truth =
      setup == Setup::eye_in_hand ? HandEyePoses{in_gripper, in_world} : HandEyePoses{in_world, in_gripper};
  const Renderer renderer(set.target, camera);
  const Rectifier rectifier(camera);
  const Finder finder = make_finder(set.target, rectifier);
  const Eigen::Matrix3Xd points = target_points(set.target);
  std::mt19937 random(3);
  for (int view = 0; view < views; ++view) {
    const Eigen::Isometry3d C = random_view(set.target, camera, least_distance, most_distance, tilt, random);
    set.images.push_back(renderer.draw(C, random));
    const Found found = finder(set.images.back());
    Observation observation;
    observation.image = std::to_string(view);
    for (const Sighting& sighting : found.sightings) {
      if (sighting.refiner != kImageModel) continue;
      observation.points = sighting.points;
      observation.pixels.resize(2, static_cast<Eigen::Index>(sighting.pixels.size()));
      for (std::size_t i = 0; i < sighting.pixels.size(); ++i)
        observation.pixels.col(static_cast<Eigen::Index>(i)) = sighting.pixels[i];
    }
    EXPECT_FALSE(observation.points.empty()) << found.reason;
    for (const PlanarPose& candidate :
         planar_poses(camera, points(Eigen::all, observation.points), observation.pixels)) {
      if (observation.T_camera_target.empty()) observation.pose_rms = candidate.rms;
      observation.T_camera_target.push_back(candidate.T_camera_target);
    }
    const auto& [X, Z] = set.truth;
    observation.T_base_gripper =
        setup == Setup::eye_in_hand ? Z * C.inverse() * X.inverse() : X * C * Z.inverse();
    set.observations.push_back(std::move(observation));
    set.true_poses.push_back(C);
  }
  return set;
}

Calibration calibrate(const RenderedSet& set) {
  const Eigen::Matrix3Xd points = target_points(set.target);
  std::vector<Symmetry> symmetries = grid_symmetries(points);
  symmetries.resize(1);  // colours and ids say which way round these targets are
  return calibrate(set.setup, set.camera, points, symmetries, set.observations);
}

struct ClosingCase {
  Setup setup;
  const char* target;
  int views;
  double least_distance, most_distance;
};

std::ostream& operator<<(std::ostream& stream, const ClosingCase& value) { return stream << value.target; }

class RenderedClosing : public testing::TestWithParam<ClosingCase> {};

TEST_P(RenderedClosing, ExactRobotClosesBelowATwentiethOfAPixel) {
  const ClosingCase& given = GetParam();
  const RenderedSet set = render(given.setup, given.target, small_camera(), given.views, given.least_distance,
                                 given.most_distance, 0.8);
  const Calibration calibration = calibrate(set);
  const Extrinsics answer = extrinsics_of(calibration, {});
  const ProjectionCheck check = check_projection(
      set.setup, calibration.poses, *answer.lens, set.target,
      with_poses_for(*answer.lens, set.target, answer.target, set.observations, answer.edge_offset),
      answer.target, answer.edge_offset);
  const double mm = 1e3 * (calibration.poses.X.translation() - set.truth.X.translation()).norm();
  const double deg =
      rotation_angle(calibration.poses.X.linear().transpose() * set.truth.X.linear()) * 180 / M_PI;
  std::printf("%-40s %2d views  closing %.4f px rms a corner, %.4f px middle; X off by %.3f mm, %.4f deg\n",
              given.target, given.views, check.corner_rms, check.centre_rms, mm, deg);
  EXPECT_LT(check.corner_rms, 0.05);  // what the project promises
}

INSTANTIATE_TEST_SUITE_P(
    Sets, RenderedClosing,
    testing::Values(ClosingCase{Setup::eye_in_hand, "chessboard:9x6:0.025", 10, 0.35, 0.6},
                    ClosingCase{Setup::eye_in_hand, "charuco:5x7:0.036:0.018:DICT_6X6_250", 10, 0.45, 0.7},
                    ClosingCase{Setup::eye_to_hand, "chessboard:9x6:0.025", 10, 0.35, 0.6},
                    ClosingCase{Setup::eye_to_hand, "charuco:5x7:0.036:0.018:DICT_6X6_250", 10, 0.45, 0.7},
                    ClosingCase{Setup::eye_to_hand, "aruco:DICT_4X4_50:0:0.09", 16, 0.7, 1.2},
                    ClosingCase{Setup::eye_to_hand, "apriltag:36h11:0:0.09", 16, 0.7, 1.2}));

// A small depth camera: its noise is what the clouds of forty views laid on each other are thick by.
TEST(CloudCheck, FortyViewsAreAsThinAsOne) {
  data::CameraIntrinsics camera = small_camera();
  camera.width = 320;
  camera.height = 240;
  camera.fx = camera.fy = 320;
  camera.cx = 159.5;
  camera.cy = 119.5;
  const RenderedSet set = render(Setup::eye_in_hand, "chessboard:9x6:0.025", camera, 40, 0.35, 0.6, 0.6);
  const Calibration calibration = calibrate(set);
  const Renderer renderer(set.target, camera);
  constexpr double kNoise = 0.001, kCount = 1e-4;  // [m]
  std::mt19937 random(11);
  std::normal_distribution<double> noise(0, kNoise);
  std::vector<TargetCloud> clouds;
  std::vector<Eigen::Isometry3d> robot;
  for (std::size_t v = 0; v < set.observations.size(); ++v) {
    data::DepthImage depth;
    depth.width = camera.width;
    depth.height = camera.height;
    for (const double z : renderer.depth(set.true_poses[v]))
      depth.pixels.push_back(z > 0 ? static_cast<std::uint16_t>(std::lround((z + noise(random)) / kCount))
                                   : 0);
    clouds.push_back(
        target_cloud(data::in_metres(depth, kCount), set.images[v], camera, set.observations[v]));
    robot.push_back(set.observations[v].T_base_gripper);
  }
  const CloudCheck right = check_clouds(set.setup, calibration.poses.X, clouds, robot);
  ASSERT_EQ(right.views.size(), 40u);
  // Noise along the ray, seen across the plane: at most that of the depth.
  EXPECT_GT(right.noise_mm, 0.8 * 1e3 * kNoise);
  EXPECT_LT(right.noise_mm, 1.02 * 1e3 * kNoise);
  EXPECT_LT(right.thickness_mm, 1.02 * right.noise_mm);
  EXPECT_LT(right.offset_mm,
            0.1);  // the noise leaves 1 mm / sqrt(3,000 points) of each view, the camera as much
  EXPECT_LT(right.shift_mm, 0.3);
  std::printf("40 views: %.3f mm thick, one view %.3f, offsets %.3f, pattern shift %.3f mm\n",
              right.thickness_mm, right.noise_mm, right.offset_mm, right.shift_mm);

  // Off by 5 mm and a degree: seen at once.
  const CloudCheck wrong =
      check_clouds(set.setup, calibration.poses.X * pose({0.003, 0, 0.004}, {0.0175, 0, 0}), clouds, robot);
  EXPECT_GT(wrong.thickness_mm, 2 * right.thickness_mm);
  EXPECT_GT(wrong.shift_mm, 1);
  EXPECT_EQ(wrong.pattern.width, 640);
}

}  // namespace
}  // namespace flash::calib
