#include "calib/detect/planar_pose.h"

#include <gtest/gtest.h>

#include "calib/dataset/target.h"
#include "calib/geometry/pose.h"
#include "tests/calib/rendered_view.h"

namespace flash::calib {
namespace {

// Both poses that perspective leaves for a far, slightly tilted marker; the true one among them.
TEST(PlanarPose, BothSolutionsAreKept) {
  const data::CameraIntrinsics camera = small_camera();
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

}  // namespace
}  // namespace flash::calib
