// A single tag in pictures whose edges stand outwards or inwards: whether the truth lies in the stated
// region.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "calib/calibrate/calibrate.h"
#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

/// The view with edges moved outwards by `offset`. They are the images of the tag's sides: at each corner
/// along the derivative of the projection.
void move_edges(const HandEyeScene& scene, const Eigen::Isometry3d& T, double offset, Observation& view) {
  const Eigen::Matrix2Xd noisy = view.pixels;
  for (Eigen::Index i = 0; i < 4; ++i) {
    Eigen::Matrix<double, 2, 3> by_point;
    project(to_vector(scene.camera), T * scene.points.col(i), &by_point);
    Eigen::Matrix2d normals;
    for (const Eigen::Index side : {0, 1}) {
      const Eigen::Vector3d along = scene.points.col((i + (side == 0 ? 1 : 3)) % 4) - scene.points.col(i),
                            away = scene.points.col(i) - scene.points.col((i + (side == 0 ? 3 : 1)) % 4);
      const Eigen::Vector2d edge = by_point * T.linear() * along, outside = by_point * T.linear() * away;
      Eigen::Vector2d normal(-edge.y(), edge.x());
      normal *= (normal.dot(outside) > 0 ? 1 : -1) / normal.norm();
      normals.row(side) = normal.transpose();
    }
    view.pixels.col(i) += normals.inverse() * Eigen::Vector2d::Constant(offset);
  }
  view.outward = outward_motion(TargetKind::aruco, noisy);
  view.T_camera_target = {fitted_pose(scene.camera, scene.points, view.pixels, view.T_camera_target.front())};
}

class EdgesThatStandOff : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(By, EdgesThatStandOff, testing::Values(0.0, -0.3, 0.25));

TEST_P(EdgesThatStandOff, HoldTheTruthInTheirRegion) {
  constexpr unsigned kDraws = 24;
  constexpr double kChiSquare95 = 12.592;
  SceneSettings settings = protocol_settings(Setup::eye_to_hand);
  settings.views = 16;
  settings.corner_px = 0.05;
  settings.robot_deg = 0.05;
  settings.robot_mm = 0.5;
  CalibrateSettings calibrate_settings;
  calibrate_settings.folds = 2;
  unsigned inside = 0;
  double squares = 0;
  for (unsigned draw = 0; draw < kDraws; ++draw) {
    HandEyeScene scene = make_scene(settings, tag_points(), 58001 + draw);
    for (std::size_t i = 0; i < scene.observations.size(); ++i)
      move_edges(scene, scene.truth.X.inverse() * scene.true_poses[i] * scene.truth.Z, GetParam(),
                 scene.observations[i]);
    const Calibration result =
        calibrate(Setup::eye_to_hand, scene.camera, scene.points, grid_symmetries(scene.points),
                  scene.observations, calibrate_settings);
    const Vector6d error = motion_between(result.poses.X, scene.truth.X);
    inside += error.dot(result.covariance.ldlt().solve(error)) < kChiSquare95;
    ASSERT_TRUE(result.edges);
    EXPECT_LE(result.edges->sd, kUsualEdgeOffset * 1.0001);
    squares += std::pow((result.edges->estimate - GetParam()) / result.edges->sd, 2);
  }
  // 0.95 less three standard deviations of 24 draws: sqrt(0.95 0.05 / 24) = 0.044.
  EXPECT_GE(inside, 0.816 * kDraws);
  // Errors of the offset over what is stated: chi2 / 24 lies below 2.13 (99.9 %). The prior holds it near
  // zero, so that errors of an offset that is near zero are smaller than stated.
  EXPECT_LT(squares / kDraws, 2.13);
}

}  // namespace
}  // namespace flash::calib
