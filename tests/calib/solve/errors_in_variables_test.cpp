#include "calib/solve/errors_in_variables.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>

#include "calib/solve/linearization.h"
#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

double rotation_error_deg(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return rotation_angle(a.linear().transpose() * b.linear()) * 180 / M_PI;
}

Eigen::Matrix3Xd target_of(Setup setup) {
  return setup == Setup::eye_in_hand ? board_points() : tag_points();
}

HandEyeScene protocol_scene(Setup setup, double robot_deg, double robot_mm, unsigned seed) {
  SceneSettings settings = protocol_settings(setup);
  settings.robot_deg = robot_deg;
  settings.robot_mm = robot_mm;
  return make_scene(settings, target_of(setup), seed);
}

Bundle seeded(const HandEyeScene& scene) {
  return make_bundle(scene.settings.setup, scene.camera, scene.points, scene.observations,
                     shah(loops_of(scene)));
}

class BothSetups : public testing::TestWithParam<Setup> {};
INSTANTIATE_TEST_SUITE_P(HandEye, BothSetups, testing::Values(Setup::eye_in_hand, Setup::eye_to_hand));

TEST_P(BothSetups, ClosedFormsAreExactWithoutNoise) {
  SceneSettings settings = protocol_settings(GetParam());
  settings.corner_px = 0;
  const HandEyeScene scene = make_scene(settings, target_of(GetParam()), 1);
  for (const HandEyePoses& poses : {park(loops_of(scene)), shah(loops_of(scene))}) {
    // What remains is the rounding of the poses fitted to the pixels.
    EXPECT_LT(motion_between(poses.X, scene.truth.X).norm(), 1e-9);
    EXPECT_LT(motion_between(poses.Z, scene.truth.Z).norm(), 1e-9);
  }
  std::vector<PoseLoop> loops = loops_of(scene);
  for (PoseLoop& loop : loops) loop.C.translation() /= 1.04;
  EXPECT_NEAR(translation_scale(loops, park(loops)), 1.04, 1e-9);
}

TEST_P(BothSetups, ResidualsHaveTheDerivativesOfTheLinearisation) {
  const HandEyeScene scene = protocol_scene(GetParam(), 0.5, 5, 2);
  Bundle bundle = seeded(scene);
  bundle.bases.push_back(make_pose({0.3, -0.2, 0.1}, {0.1, 0.2, -0.4}));
  bundle.time_offsets.push_back(0.02);
  bundle.pivots.push_back({0.1, 0.2, 0.3});
  bundle.views.resize(1);
  bundle.poses.resize(1);
  bundle.poses[0].arm = 1;
  bundle.poses[0].correction = make_pose({0.004, -0.003, 0.002}, {0.02, -0.01, 0.03});
  bundle.poses[0].velocity << 0.1, -0.2, 0.05, 0.3, 0.1, -0.2;
  bundle.intrinsics[0].model = data::DistortionModel::rational_polynomial;
  bundle.intrinsics[0].distortion = {0.1, -0.2, 0.001, -0.002, 0.05, 0.02, -0.03, 0.01};
  bundle.scales[0] = 1.02;
  const Unknowns unknowns{
      .corrections = true, .intrinsics = kIntrinsics, .scales = true, .time_offsets = true};
  const SharedColumns columns = shared_columns(bundle, unknowns);
  double count = 0;
  const Eigen::MatrixXd gram = corner_gram(bundle, bundle.views[0], unknowns, columns, 1, 0, count);
  const Eigen::Index width = 6 + columns.count;
  const auto shifted = [&](Eigen::Index column, double step) {
    Bundle b = bundle;
    const Eigen::Index shared = column - 6;
    const auto pose_step = [&](Eigen::Isometry3d& T, Eigen::Index first) {
      if (first < 0 || column - first < 0 || column - first >= 6) return;
      T = moved(T, step * Vector6d::Unit(column - first));
    };
    pose_step(b.poses[0].correction, 0);
    pose_step(b.cameras[0], 6 + columns.cameras[0]);
    pose_step(b.targets[0], 6 + columns.targets[0]);
    pose_step(b.bases[1], 6 + columns.bases[1]);
    if (shared >= columns.intrinsics[0] && shared < columns.intrinsics[0] + kIntrinsics) {
      IntrinsicsVector v = to_vector(b.intrinsics[0]);
      v[shared - columns.intrinsics[0]] += step;
      b.intrinsics[0] = with_vector(b.intrinsics[0], v);
    }
    if (shared == columns.scales[0]) b.scales[0] += step;
    if (shared == columns.time_offsets[1]) b.time_offsets[1] += step;
    const Eigen::Matrix2Xd r = -residuals(b, b.views[0]);
    return Eigen::VectorXd(r.reshaped());
  };
  Eigen::MatrixXd J(2 * scene.points.cols(), width + 1);
  constexpr double kStep = 1e-6;
  for (Eigen::Index c = 0; c < width; ++c) J.col(c) = (shifted(c, kStep) - shifted(c, -kStep)) / (2 * kStep);
  J.col(width) = shifted(0, 0);
  const Eigen::MatrixXd expected = J.transpose() * J;
  // Central differences of 1e-6 on residuals of some hundred pixels: 1e-8 of each column's size.
  const Eigen::VectorXd size = expected.diagonal().cwiseSqrt().cwiseMax(1e-9);
  EXPECT_EQ(count, 2 * static_cast<double>(scene.points.cols()));
  EXPECT_LT(
      (size.asDiagonal().inverse() * (gram - expected) * size.asDiagonal().inverse()).cwiseAbs().maxCoeff(),
      1e-6);
}

TEST_P(BothSetups, DepthResidualHasTheDerivativesOfTheChain) {
  const HandEyeScene scene = protocol_scene(GetParam(), 0.5, 5, 3);
  Bundle bundle = seeded(scene);
  const BundleView& view = bundle.views[0];
  const Eigen::Vector3d measured = 1.01 * (predicted_pose(bundle, view) * Eigen::Vector3d(0.02, 0.03, 0));
  const DepthResidual depth = depth_residual(chain_of(bundle, view), measured);
  EXPECT_NEAR(depth.value, 0.01 / 1.01 * measured.z(), 1e-12);
  const Chain::Derivative d = chain_of(bundle, view).d_correction(depth.material);
  for (int k = 0; k < 6; ++k) {
    const auto value = [&](double step) {
      Bundle b = bundle;
      b.poses[0].correction = moved(b.poses[0].correction, step * Vector6d::Unit(k));
      return depth_residual(chain_of(b, view), measured).value;
    };
    EXPECT_NEAR((value(1e-6) - value(-1e-6)) / 2e-6, -depth.d_material.dot(d.col(k)),
                2e-2 * std::abs(depth.d_material.dot(d.col(k))) + 2e-2)
        << "the factor along the ray is held, to first order in the residual";
  }
}

TEST_P(BothSetups, ExactRobotIsFoundToBeExact) {
  const HandEyeScene scene = protocol_scene(GetParam(), 0, 0, 4);
  Bundle plain = seeded(scene);
  solve_bundle(plain, uniform_noise(plain, 0.1, 1, 1, 1), {.unknowns = {.corrections = false}, .huber = 0});
  const Refinement refined = refine(seeded(scene));
  EXPECT_TRUE(refined.converged);
  EXPECT_NEAR(refined.noise.corner.front(), 0.1, 0.015);  // 160 residuals: 6 %
  const Vector6d sd = refined.covariance.diagonal().head<6>().cwiseSqrt();
  const Vector6d apart = motion_between(plain.cameras.front(), refined.bundle.cameras.front());
  EXPECT_TRUE((apart.cwiseAbs().array() < sd.array()).all()) << apart.transpose() << " / " << sd.transpose();
}

TEST_P(BothSetups, NoiseIsEstimatedAndTheStatedUncertaintyIsTrue) {
  constexpr int kTrials = 12;
  std::vector<double> closed, bundled, corrected;
  double nees = 0, corner = 0, rotation = 0, translation = 0;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    const HandEyeScene scene = protocol_scene(GetParam(), 0.1, 1, 100 + trial);
    closed.push_back(rotation_error_deg(park(loops_of(scene)).X, scene.truth.X));
    Bundle plain = seeded(scene);
    solve_bundle(plain, uniform_noise(plain, 1, 1, 1, 1), {.unknowns = {.corrections = false}, .huber = 0});
    bundled.push_back(rotation_error_deg(plain.cameras.front(), scene.truth.X));
    const Refinement refined = refine(seeded(scene));
    corrected.push_back(rotation_error_deg(refined.bundle.cameras.front(), scene.truth.X));
    const Vector6d error = motion_between(refined.bundle.cameras.front(), scene.truth.X);
    nees += error.dot(refined.covariance.topLeftCorner<6, 6>().ldlt().solve(error)) / kTrials;
    corner += refined.noise.corner.front() / kTrials;
    rotation += refined.noise.rotation.front() * 180 / M_PI / kTrials;
    translation += refined.noise.translation.front() * 1e3 / kTrials;
  }
  EXPECT_GT(nees, 3.4);  // chi-square with 72 degrees of freedom, 99.99 % band, over 12
  EXPECT_LT(nees, 9.6);
  EXPECT_NEAR(corner, 0.1, 0.01);
  EXPECT_NEAR(rotation, 0.1, 0.015);  // 12 x 45 residuals or more: 3 %; four times that
  EXPECT_NEAR(translation, 1, 0.15);
  const auto median = [](std::vector<double> v) {
    std::sort(v.begin(), v.end());
    return v[v.size() / 2];
  };
  EXPECT_LT(median(corrected), 0.7 * median(bundled));
  EXPECT_LT(median(corrected), 1.2 * median(closed));
}

TEST(HandEye, HeldOutViewsShowTheNoiseOfTheRobot) {
  SceneSettings settings = protocol_settings(Setup::eye_in_hand);
  settings.views = 40;
  settings.robot_deg = 0.1;
  settings.robot_mm = 1;
  const HandEyeScene scene = make_scene(settings, board_points(), 6);
  const Refinement refined = refine(seeded(scene));
  std::vector<Eigen::Isometry3d> poses;
  for (const Observation& observation : scene.observations)
    poses.push_back(observation.T_camera_target.front());
  RefineSettings again;
  again.noise = refined.noise;
  const HeldOut held = hold_out(refined.bundle, poses, Method::errors_in_variables, again);
  EXPECT_NEAR(held.deg, std::sqrt(3.0) * 0.1, 0.05);  // three axes; 120 numbers: 7 %, and the fit's own part
  // Seen from 0.42 m: 1 mm an axis and the lever of 0.1 deg, 0.5 m away.
  EXPECT_NEAR(held.mm, std::sqrt(3.0 + 2 * std::pow(0.1 * M_PI / 180 * 500, 2)), 0.5);
  EXPECT_GT(held.px, 10 * reprojection_rms(refined.bundle));
}

}  // namespace
}  // namespace flash::calib
