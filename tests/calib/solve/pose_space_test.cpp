#include "calib/solve/pose_space.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <random>

#include "data/numbers/chi_square.h"
#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

/// Of the camera: turns, places across the line of sight and along it.
struct Noise {
  double turn = 0.1 * M_PI / 180, across = 1e-3, along = 1e-3;  ///< [rad], [m]
};

struct NoisyLoops {
  std::vector<PoseLoop> loops;
  HandEyePoses truth;
};

/// An exact robot, and a camera with such noise.
NoisyLoops noisy_loops(int views, const Noise& noise, unsigned seed) {
  SceneSettings settings = protocol_settings(Setup::eye_in_hand);
  settings.views = views;
  const HandEyeScene scene = make_scene(settings, Eigen::Matrix3Xd(board_points()), seed);
  std::mt19937 random(1000 + seed);
  std::normal_distribution<double> normal;
  const auto normal3 = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  NoisyLoops result{loops_of(scene), scene.truth};
  for (PoseLoop& loop : result.loops) {
    loop.C = scene.truth.X.inverse() * loop.G.inverse() * scene.truth.Z;
    const Eigen::Vector3d sight = loop.C.translation().normalized(), error = normal3();
    loop.C.translation() +=
        noise.across * (error - sight * sight.dot(error)) + noise.along * sight * normal(random);
    loop.C.linear() *= rotation_exp(noise.turn * normal3());
  }
  return result;
}

/// Weighted residuals of poses moved by (d_X, d_Z), in the camera's frame.
Eigen::VectorXd weighted_residuals(const std::vector<PoseLoop>& loops, const HandEyePoses& poses,
                                   const Eigen::VectorXd& step, const Noise& noise) {
  const Eigen::Isometry3d X = moved(poses.X, step.head<6>()), Z = moved(poses.Z, step.tail<6>());
  Eigen::VectorXd residuals(6 * static_cast<Eigen::Index>(loops.size()));
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const Eigen::Isometry3d predicted = X.inverse() * loops[i].G.inverse() * Z;
    const Eigen::Vector3d sight = loops[i].C.translation().normalized(),
                          apart = loops[i].C.translation() - predicted.translation();
    residuals.segment<3>(6 * static_cast<Eigen::Index>(i)) =
        (apart - sight * sight.dot(apart)) / noise.across + sight * sight.dot(apart) / noise.along;
    residuals.segment<3>(6 * static_cast<Eigen::Index>(i) + 3) =
        rotation_log(predicted.linear().transpose() * loops[i].C.linear()) / noise.turn;
  }
  return residuals;
}

/// Weighted least squares with the true noise levels, by finite differences: as good as can be.
HandEyePoses fit_with_known_noise(const std::vector<PoseLoop>& loops, HandEyePoses poses,
                                  const Noise& noise) {
  constexpr double kStep = 1e-6;
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(12);
  for (int iteration = 0; iteration < 8; ++iteration) {
    const Eigen::VectorXd here = weighted_residuals(loops, poses, none, noise);
    Eigen::MatrixXd jacobian(here.size(), 12);
    for (Eigen::Index k = 0; k < 12; ++k)
      jacobian.col(k) = (weighted_residuals(loops, poses, kStep * Eigen::VectorXd::Unit(12, k), noise) -
                         weighted_residuals(loops, poses, -kStep * Eigen::VectorXd::Unit(12, k), noise)) /
                        (2 * kStep);
    const Eigen::VectorXd step = -(jacobian.transpose() * jacobian).ldlt().solve(jacobian.transpose() * here);
    poses = {moved(poses.X, step.head<6>()), moved(poses.Z, step.tail<6>())};
  }
  return poses;
}

/// Over many trials.
struct Account {
  double inside = 0;             ///< share within the 95 % region
  double across = 0, along = 0;  ///< mean estimates [m]
  double error = 0, least = 0;   ///< rms of X's place, and of that with known noise [m]
};

Account account(int trials, int views, const Noise& noise) {
  Account result;
  for (int trial = 0; trial < trials; ++trial) {
    const NoisyLoops noisy = noisy_loops(views, noise, 300 + static_cast<unsigned>(trial));
    const PoseSpaceFit fit = fit_pose_space(noisy.loops, shah(noisy.loops));
    EXPECT_TRUE(fit.converged);
    const Vector6d error = motion_between(fit.poses.X, noisy.truth.X);
    const double square = error.dot(fit.covariance.topLeftCorner<6, 6>().ldlt().solve(error));
    result.inside += (square < data::chi_square_95_of_6 ? 1.0 : 0.0) / trials;
    result.across += fit.translation.across / trials;
    result.along += fit.translation.along / trials;
    result.error += error.head<3>().squaredNorm() / trials;
    const HandEyePoses known = fit_with_known_noise(noisy.loops, noisy.truth, noise);
    result.least += motion_between(known.X, noisy.truth.X).head<3>().squaredNorm() / trials;
  }
  result.error = std::sqrt(result.error);
  result.least = std::sqrt(result.least);
  return result;
}

TEST(PoseSpace, NoiseAlongTheLineOfSightIsToldFromThatAcrossIt) {
  const Account found = account(100, 20, {.across = 0.5e-3, .along = 4e-3});
  EXPECT_NEAR(found.across, 0.5e-3, 0.05e-3);
  EXPECT_NEAR(found.along, 4e-3, 0.4e-3);
  EXPECT_GT(found.inside, 0.88);  // 100 trials of 95 %: three deviations of 2.2 %
  EXPECT_LT(found.error, 1.05 * found.least);
}

TEST(PoseSpace, NoiseThatIsAlikeAllAroundCostsNothing) {
  for (const int views : {6, 8, 20}) {
    const Account found = account(100, views, {});
    EXPECT_GT(found.inside, 0.88) << views;
    EXPECT_LT(found.error, (views < 10 ? 1.1 : 1.03) * found.least) << views;
    if (views < 20) continue;
    EXPECT_NEAR(found.across, 1e-3, 0.1e-3);
    EXPECT_NEAR(found.along, 1e-3, 0.15e-3);
  }
}

// What a camera errs by along the line of sight grows with the scale: it makes neither the target look
// smaller nor the focal length shorter.
TEST(PoseSpace, NoiseAlongTheLineOfSightIsTheCamerasWhereScalesAreSolvedFor) {
  constexpr int kTrials = 100;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero(), squares = mean;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    const NoisyLoops noisy = noisy_loops(20, {.across = 0.2e-3, .along = 8e-3}, 600 + trial);
    const Eigen::Vector2d logs =
        fit_pose_space(noisy.loops, shah(noisy.loops),
                       ScalesUnknown{.focal_length_sd = std::numeric_limits<double>::infinity()})
            .scales.logs();
    mean += logs / kTrials;
    squares += logs.cwiseAbs2() / kTrials;
  }
  for (Eigen::Index i = 0; i < 2; ++i)
    EXPECT_LT(std::abs(mean[i]), 3 * std::sqrt((squares[i] - mean[i] * mean[i]) / kTrials)) << i;
}

// An unknown focal length widens what is stated of X, and no more than it has to.
TEST(PoseSpace, AnUnknownFocalLengthIsStatedByItsErrors) {
  constexpr int kTrials = 60;
  double chi_square = 0, of_scale = 0;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    NoisyLoops noisy = noisy_loops(20, {}, 800 + trial);
    const double truth = 1 + 0.01 * (static_cast<double>(trial % 5) - 2);
    noisy.loops = rescaled(std::move(noisy.loops), {.focal_length = 1 / truth});
    const PoseSpaceFit fit = fit_pose_space(
        noisy.loops, shah(noisy.loops),
        ScalesUnknown{.size_sd = 0, .focal_length_sd = std::numeric_limits<double>::infinity()});
    const Vector6d error = motion_between(fit.poses.X, noisy.truth.X);
    chi_square += error.dot(fit.covariance.topLeftCorner<6, 6>().ldlt().solve(error)) / kTrials;
    of_scale += std::pow(std::log(fit.scales.focal_length / truth), 2) / fit.covariance(13, 13) / kTrials;
    EXPECT_EQ(fit.covariance(12, 12), 0);
  }
  EXPECT_NEAR(chi_square, 6, 3 * std::sqrt(12.0 / kTrials));
  EXPECT_NEAR(of_scale, 1, 3 * std::sqrt(2.0 / kTrials));
}

// Such poses are those of a target that turns about the camera. They have no line of sight.
TEST(PoseSpace, TargetAtTheCamerasOriginIsFitted) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  NoisyLoops noisy = noisy_loops(20, {}, 7);
  for (PoseLoop& loop : noisy.loops) {
    loop.C.translation().setZero();
    Vector6d error = Vector6d::Zero();
    for (Eigen::Index k = 0; k < 3; ++k) error[k] = 1e-3 * normal(random);
    loop.G = moved(noisy.truth.Z * (noisy.truth.X * loop.C).inverse(), error);
  }
  const PoseSpaceFit fit = fit_pose_space(noisy.loops, shah(noisy.loops));
  EXPECT_TRUE(fit.converged);
  EXPECT_NEAR(fit.translation.across, 1e-3, 0.3e-3);  // 48 degrees of freedom: 10 %
  EXPECT_LT(motion_between(fit.poses.X, noisy.truth.X).head<3>().norm(), 2e-3);
}

TEST(PoseSpace, StatedUncertaintyIsTrue) {
  constexpr int kTrials = 40;
  double chi_square = 0, rotation = 0, translation = 0;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    SceneSettings settings = protocol_settings(Setup::eye_to_hand);
    settings.corner_px = 0.001;
    settings.robot_deg = 0.2;
    settings.robot_mm = 1;
    const HandEyeScene scene = make_scene(settings, board_points(), 50 + trial);
    const PoseSpaceFit fit = fit_pose_space(loops_of(scene), park(loops_of(scene)));
    EXPECT_TRUE(fit.converged);
    const Vector6d error = motion_between(fit.poses.X, scene.truth.X);
    chi_square += error.dot(fit.covariance.topLeftCorner<6, 6>().ldlt().solve(error)) / kTrials;
    rotation += fit.rotation * 180 / M_PI / kTrials;
    translation += 1e3 * fit.translation.rms() / kTrials;
  }
  EXPECT_GT(chi_square, 4.4);  // 240 degrees of freedom over 40, 99.8 %
  EXPECT_LT(chi_square, 7.9);
  EXPECT_NEAR(rotation, 0.2, 0.01);
  // The target hangs 0.12 m from the gripper: a turn of 0.2 deg adds 0.4 mm across.
  EXPECT_NEAR(translation, 1.05, 0.12);
}

}  // namespace
}  // namespace flash::calib
