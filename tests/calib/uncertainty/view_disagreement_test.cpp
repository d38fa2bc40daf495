// What corners of a view share shows between views, and is stated.
#include "calib/uncertainty/view_disagreement.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "calib/calibrate/calibrate.h"
#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

/// Forty views, of which the print bends by `bend` [m] otherwise in each: two recordings of one rig.
HandEyeScene rig_of(double bend, unsigned seed) {
  SceneSettings settings = protocol_settings(Setup::eye_in_hand);
  settings.views = 40;
  settings.robot_deg = 0.03;
  settings.robot_mm = 0.3;
  HandEyeScene scene = make_scene(settings, board_points(), seed);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < scene.observations.size(); ++i) {
    const Eigen::Isometry3d T = scene.truth.X.inverse() * scene.true_poses[i].inverse() * scene.truth.Z;
    Warp warp;
    for (double& number : warp) number = bend * normal(random);
    const Eigen::Matrix3Xd points = shaped(scene.points, target_bows(scene.points), {.warp = warp});
    Observation& o = scene.observations[i];
    for (Eigen::Index k = 0; k < points.cols(); ++k)
      o.pixels.col(k) = project(to_vector(scene.camera), T * points.col(k)) +
                        settings.corner_px * Eigen::Vector2d(normal(random), normal(random));
    o.T_camera_target = {fitted_pose(scene.camera, scene.points, o.pixels, T)};
  }
  return scene;
}

Calibration half_of(const HandEyeScene& rig, std::ptrdiff_t half) {
  CalibrateSettings settings;
  settings.folds = 2;
  const auto first = rig.observations.begin() + 20 * half;
  return calibrate(rig.settings.setup, rig.camera, rig.points, grid_symmetries(rig.points),
                   {first, first + 20}, settings);
}

TEST(ViewDisagreement, OfAPrintThatBendsIsInTheDeviationsOfTheLensAndOfAnotherRecording) {
  constexpr unsigned kRigs = 6;
  double lens = 0, of_corners = 0, apart = 0;
  for (unsigned seed = 0; seed < kRigs; ++seed) {
    const HandEyeScene rig = rig_of(5e-4, 8200 + seed);
    const Calibration halves[] = {half_of(rig, 0), half_of(rig, 1)};
    for (const Calibration& half : halves) {
      EXPECT_GT(half.lens_view_factor, 3);
      const double squares =
          ((half.lens.estimate - to_vector(rig.camera)).head<4>().array() / half.lens.sd.head<4>().array())
              .square()
              .mean();
      lens += squares / (2 * kRigs);
      of_corners += squares * half.lens_view_factor / (2 * kRigs);
    }
    const Vector6d between = motion_between(halves[0].poses.X, halves[1].poses.X);
    apart += between.dot((halves[0].repeatable + halves[1].repeatable).ldlt().solve(between)) / (6 * kRigs);
  }
  // 48 squares of unit mean, four of a recording correlated, and 36: three standard deviations and more.
  EXPECT_LT(lens, 1.8);
  EXPECT_GT(lens, 0.15);  // a bend moves all corners of a view alike: deviations are on the safe side
  EXPECT_GT(of_corners, 3);
  EXPECT_LT(apart, 1.8);
}

TEST(ViewDisagreement, IsAboutNoneWhereViewsScatterAsTheirCornersSay) {
  double lens = 0, camera = 0;
  constexpr unsigned kRigs = 6;
  for (unsigned seed = 0; seed < kRigs; ++seed) {
    const Calibration result = half_of(rig_of(0, 8300 + seed), 0);
    const BundleSettings settings{.unknowns = result.unknowns};
    lens += lens_disagreement(result.refined, settings) / kRigs;
    camera += camera_disagreement(result.refined, settings) / kRigs;
  }
  // No less than one each, and larger by chance: chi-square of some twenty numbers over its freedom.
  EXPECT_LT(lens, 1.4);
  EXPECT_LT(camera, 1.6);
}

// All else is where it was, given the lens.
TEST(ViewDisagreement, RaisesTheLensAndWhatFollowsIt) {
  const Calibration result = half_of(rig_of(0, 8400), 0);
  const Eigen::MatrixXd& C = result.refined.covariance;
  const SharedColumns columns = shared_columns(result.refined.bundle, result.unknowns);
  const Eigen::MatrixXd raised = with_lens_raised(C, columns, 4);
  const int first = columns.intrinsics.front();
  EXPECT_TRUE(raised.block(first, first, 9, 9).isApprox(4 * C.block(first, first, 9, 9), 1e-9));
  std::vector<int> lens;
  for (int i = 0; i < columns.intrinsics_count; ++i) lens.push_back(first + i);
  for (int i = 0; i < kWarp; ++i) lens.push_back(columns.warps.front() + i);
  const auto given_lens = [&](const Eigen::MatrixXd& all) -> Matrix6d {
    const Eigen::MatrixXd cross = all(lens, Eigen::all).leftCols<6>();
    return all.topLeftCorner<6, 6>() - cross.transpose() * all(lens, lens).ldlt().solve(cross);
  };
  EXPECT_TRUE(given_lens(raised).isApprox(given_lens(C), 1e-6));
}

}  // namespace
}  // namespace flash::calib
