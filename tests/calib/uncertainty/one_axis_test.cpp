#include "calib/uncertainty/one_axis.h"

#include <gtest/gtest.h>

#include <Eigen/SVD>

#include "tests/calib/four_axis_scene.h"

namespace flash::calib {
namespace {

class AboutOneAxis : public testing::TestWithParam<Setup> {};

/// Without noise; the base and all in it turned, so that the axis is none of a frame.
HandEyeScene exact_scene(Setup setup, unsigned seed) {
  return make_four_axis_scene({.setup = setup,
                               .corner_px = 0,
                               .robot_deg = 0,
                               .robot_mm = 0,
                               .mount = rotation_exp({0.4, -0.7, 0.2})},
                              seed);
}

std::vector<Eigen::Isometry3d> reported(const HandEyeScene& scene) {
  std::vector<Eigen::Isometry3d> poses;
  for (const Observation& o : scene.observations) poses.push_back(o.T_base_gripper);
  return poses;
}

/// Closing errors of all views, stacked.
Eigen::VectorXd closing(const HandEyeScene& scene, const HandEyePoses& poses) {
  Eigen::VectorXd errors(6 * scene.observations.size());
  for (std::size_t i = 0; i < scene.observations.size(); ++i) {
    const Eigen::Isometry3d C = scene.truth.X.inverse() *
                                pose_loop(scene.settings.setup, scene.true_poses[i], {}).G.inverse() *
                                scene.truth.Z;
    const Eigen::Isometry3d G = pose_loop(scene.settings.setup, scene.true_poses[i], {}).G;
    errors.segment<6>(6 * static_cast<Eigen::Index>(i)) = motion_between(poses.Z, G * poses.X * C);
  }
  return errors;
}

// The only direction of (X, Z) that moves no closing error is the camera along the axis with the target: the
// last singular vector of a Jacobian by central differences. h^2 truncation: 1e-8 of lengths below 1 m.
TEST_P(AboutOneAxis, TheUntoldDirectionIsTheNullSpaceOfTheClosedChain) {
  const HandEyeScene scene = exact_scene(GetParam(), 1);
  const std::optional<OneAxis> axis = one_axis(GetParam(), reported(scene));
  ASSERT_TRUE(axis);
  constexpr double kStep = 1e-4;
  Eigen::MatrixXd J(6 * scene.observations.size(), 12);
  for (Eigen::Index k = 0; k < 12; ++k) {
    Eigen::VectorXd side[2];
    for (const int s : {0, 1}) {
      Vector6d step = Vector6d::Zero();
      step[k % 6] = s == 0 ? -kStep : kStep;
      HandEyePoses poses = scene.truth;
      (k < 6 ? poses.X : poses.Z) = moved(k < 6 ? poses.X : poses.Z, step);
      side[s] = closing(scene, poses);
    }
    J.col(k) = (side[1] - side[0]) / (2 * kStep);
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(J, Eigen::ComputeThinV);
  const Eigen::VectorXd values = svd.singularValues();
  EXPECT_LT(values[11], 1e-6 * values[0]);
  EXPECT_GT(values[10], 1e-3 * values[0]);
  Eigen::VectorXd untold = Eigen::VectorXd::Zero(12);
  untold.head<6>() = untold_direction(*axis, scene.truth.X);
  untold.segment<3>(6) = axis->sense * scene.truth.Z.linear().transpose() * axis->target;
  untold.normalize();
  EXPECT_NEAR(std::abs(untold.dot(svd.matrixV().col(11))), 1, 1e-6);
}

TEST_P(AboutOneAxis, ClosedFormFindsAllButThePlaceAlongIt) {
  const HandEyeScene scene = exact_scene(GetParam(), 2);
  const std::optional<OneAxis> axis = one_axis(GetParam(), reported(scene));
  ASSERT_TRUE(axis);
  std::vector<PoseLoop> loops;
  for (const Eigen::Isometry3d& pose : scene.true_poses) {
    const Eigen::Isometry3d G = pose_loop(GetParam(), pose, {}).G;
    loops.push_back({G, scene.truth.X.inverse() * G.inverse() * scene.truth.Z});
  }
  const HandEyePoses found = of_one_axis(loops);
  EXPECT_LT(closing_rms(loops, found).rotation, 1e-9);
  EXPECT_LT(closing_rms(loops, found).translation, 1e-9);
  EXPECT_LT(rotation_angle(found.X.linear().transpose() * scene.truth.X.linear()), 1e-9);
  const Eigen::Vector3d off = found.X.translation() - scene.truth.X.translation();
  EXPECT_LT((off - axis->camera * axis->camera.dot(off)).norm(), 1e-9);
}

TEST(OneAxis, IsNoneOfTurnsAboutTwo) {
  const HandEyeScene scene = protocol_scene(Setup::eye_in_hand, 0, 0, 3);
  EXPECT_FALSE(one_axis(Setup::eye_in_hand, scene.true_poses));
}

// Noise of sigma an axis makes differences of two poses turn by sqrt(2) sigma about each of two axes.
TEST(OneAxis, TiltsOfTheNoiseAreNoise) {
  const OneAxis still{}, noisy{.across2 = 4e-6}, tilted{.across2 = 4e-4};
  EXPECT_EQ(still.noise_share(1e-3), 1);
  EXPECT_EQ(noisy.noise_share(1e-3), 1);
  EXPECT_NEAR(tilted.noise_share(1e-3), 0.01, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Setups, AboutOneAxis, testing::Values(Setup::eye_in_hand, Setup::eye_to_hand),
                         [](const auto& setup) {
                           return setup.param == Setup::eye_in_hand ? "EyeInHand" : "EyeToHand";
                         });

}  // namespace
}  // namespace flash::calib
