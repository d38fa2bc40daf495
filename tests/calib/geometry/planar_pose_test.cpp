#include "calib/geometry/planar_pose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "calib/dataset/target.h"
#include "calib/geometry/pose.h"

namespace flash::calib {
namespace {

data::CameraIntrinsics straight_camera() {
  return {.width = 640, .height = 480, .fx = 615, .fy = 615, .cx = 319.5, .cy = 239.5, .distortion = {}};
}

data::CameraIntrinsics bent_camera() {
  return {.width = 640,
          .height = 480,
          .fx = 610,
          .fy = 612,
          .cx = 322,
          .cy = 239,
          .model = data::DistortionModel::plumb_bob,
          .distortion = {-0.11, 0.07, 4e-4, -3e-4, 0}};
}

// Both poses that perspective leaves for a far, slightly tilted marker; the true one among them.
TEST(PlanarPose, BothSolutionsAreKept) {
  const data::CameraIntrinsics camera = straight_camera();
  const Eigen::Matrix3Xd points = target_points(parse_target("aruco:DICT_4X4_50:0:0.05"));
  Eigen::Isometry3d truth = Eigen::Isometry3d::Identity();
  truth.linear() = rotation_exp(Eigen::Vector3d(0.5, 0, 0));
  truth.translation() = Eigen::Vector3d(0.05, 0.02, 1.2);
  Eigen::Matrix2Xd pixels(2, 4);
  for (Eigen::Index i = 0; i < 4; ++i) pixels.col(i) = *data::project(camera, truth * points.col(i));
  const std::vector<PlanarPose> poses = planar_poses(camera, points, pixels);
  ASSERT_EQ(poses.size(), 2u);
  EXPECT_LT(poses[0].rms, 1e-6);
  EXPECT_LT((poses[0].T_camera_target.matrix() - truth.matrix()).norm(), 1e-6);
  EXPECT_GT(poses[1].rms, poses[0].rms);
  EXPECT_LT(poses[1].rms, 0.3);
  EXPECT_TRUE(planar_poses(camera, points.leftCols(3), pixels.leftCols(3)).empty());
  Eigen::Matrix3Xd line = points;
  line.row(1).setZero();
  EXPECT_TRUE(planar_poses(camera, line, pixels).empty());
}

// Of corners without noise, from before the picture to its edge, through a lens that bends.
TEST(PlanarPose, ExactCornersGiveTheExactPose) {
  const data::CameraIntrinsics camera = bent_camera();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> share(-1, 1);
  for (const char* words : {"aruco:DICT_4X4_50:0:0.08", "chessboard:9x6:0.02", "chessboard:3x3:0.05"}) {
    const Eigen::Matrix3Xd points = target_points(parse_target(words));
    for (int round = 0; round < 40; ++round) {
      Eigen::Isometry3d truth = Eigen::Isometry3d::Identity();
      truth.linear() = rotation_exp(Eigen::Vector3d(share(random), share(random), 3 * share(random)));
      truth.translation() =
          Eigen::Vector3d(0.1 * share(random), 0.08 * share(random), 0.6 + 0.2 * share(random)) -
          truth.linear() * points.rowwise().mean();
      Eigen::Matrix2Xd pixels(2, points.cols());
      for (Eigen::Index i = 0; i < points.cols(); ++i)
        pixels.col(i) = *data::project(camera, truth * points.col(i));
      const std::vector<PlanarPose> poses = planar_poses(camera, points, pixels);
      ASSERT_FALSE(poses.empty()) << words << " " << round;
      // Levenberg and Marquardt end where a step gains less than 1e-12 of the cost.
      EXPECT_LT((poses[0].T_camera_target.matrix() - truth.matrix()).norm(), 1e-6) << words << " " << round;
    }
  }
}

// Corners that are no numbers, or all at one place, are seen from nowhere.
TEST(PlanarPose, CornersThatShowNoPlaneHaveNoPose) {
  const data::CameraIntrinsics camera = straight_camera();
  const Eigen::Matrix3Xd points = target_points(parse_target("chessboard:4x3:0.02"));
  EXPECT_TRUE(planar_poses(camera, points, Eigen::Matrix2Xd::Constant(2, 12, std::nan(""))).empty());
  for (const PlanarPose& pose : planar_poses(camera, points, Eigen::Matrix2Xd::Constant(2, 12, 100)))
    EXPECT_TRUE(std::isfinite(pose.rms));
}

}  // namespace
}  // namespace flash::calib
