#include "calib/check/contradiction.h"

#include <gtest/gtest.h>

#include "calib/calibrate/calibrate.h"
#include "calib/geometry/pose.h"
#include "tests/calib/hand_eye_scene.h"
#include "tests/calib/pairs_of_scene.h"

namespace flash::calib {
namespace {

class Contradicts : public testing::TestWithParam<Setup> {};
INSTANTIATE_TEST_SUITE_P(HandEye, Contradicts, testing::Values(Setup::eye_in_hand, Setup::eye_to_hand));

SceneSettings settings_of(Setup setup) {
  SceneSettings settings = protocol_settings(setup);
  settings.distance = 0.42;
  settings.spread = {0.05, 0.035, 0.10};
  settings.robot_deg = 0.05;
  settings.robot_mm = 0.5;
  return settings;
}

/// A board of 9 x 6 in both setups, calibrated from one half of the views and held against the other, which
/// sees target and camera where they are said to be.
struct Validation {
  Extrinsics extrinsics;
  Contradiction found;
};

Validation validated(Setup setup, unsigned seed, const Vector6d& camera_motion, const Vector6d& target_motion,
                     bool refit_target = false, double target_size = 1) {
  SceneSettings settings = settings_of(setup);
  settings.views = 30;
  const Target target = parse_target("chessboard:9x6:0.025");
  HandEyeScene scene = make_scene(settings, target_points(target), seed);
  const auto middle = scene.observations.begin() + 18;
  const Calibration calibration = calibrate(setup, scene.camera, scene.points, grid_symmetries(scene.points),
                                            {scene.observations.begin(), middle});
  std::vector<Observation> views(middle, scene.observations.end());
  const HandEyePoses now{moved(scene.truth.X, camera_motion), moved(scene.truth.Z, target_motion)};
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Eigen::Isometry3d& pose = scene.true_poses[18 + i];
    const Eigen::Isometry3d T =
        now.X.inverse() * (setup == Setup::eye_in_hand ? pose.inverse() : pose) * now.Z;
    for (Eigen::Index k = 0; k < scene.points.cols(); ++k)
      views[i].pixels.col(k) =
          project(to_vector(scene.camera),
                  T * (target_size * scene.points.col(views[i].points[static_cast<std::size_t>(k)])));
    views[i].T_camera_target = {T};
  }
  Validation result;
  result.extrinsics = extrinsics_of(calibration, {});
  result.extrinsics.held_out = {calibration.held_out.deg * M_PI / 180, 1e-3 * calibration.held_out.mm};
  const data::CameraIntrinsics lens = *result.extrinsics.lens;
  views =
      with_poses_for(lens, target, result.extrinsics.target, std::move(views), result.extrinsics.edge_offset);
  HandEyePoses poses = calibration.poses;
  if (refit_target) poses.Z = target_pose_from(setup, poses.X, views);
  const ProjectionCheck check = check_projection(setup, poses, lens, target, views, result.extrinsics.target,
                                                 result.extrinsics.edge_offset);
  result.found = contradiction(result.extrinsics, poses, refit_target, lens, target, views, check);
  return result;
}

Vector6d shift(double x, double y, double z) {
  Vector6d motion = Vector6d::Zero();
  motion.head<3>() << x, y, z;
  return motion;
}

TEST_P(Contradicts, NothingWhereNothingHasMoved) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Contradiction found = validated(GetParam(), seed, shift(0, 0, 0), shift(0, 0, 0)).found;
    EXPECT_LT(found.ratio,
              2);  // an rms over 12 views is within 40 % of what is stated, which is itself known to 25 %
    EXPECT_EQ(found.sentence, "");
  }
}

TEST_P(Contradicts, ATargetThatHasMovedIsTold) {
  const Contradiction found = validated(GetParam(), 3, shift(0, 0, 0), shift(0.012, -0.02, 0.01)).found;
  EXPECT_NE(found.sentence.find("the target is not where it was at the calibration, by 2"), std::string::npos)
      << found.sentence;  // 25 mm
}

TEST_P(Contradicts, ACameraThatHasMovedIsToldWhereverTheTargetIsTaken) {
  for (const bool refit_target : {false, true}) {
    const Contradiction found =
        validated(GetParam(), 3, shift(0.012, -0.02, 0.01), shift(0, 0, 0), refit_target).found;
    EXPECT_NE(found.sentence.find("the camera is not where it was at the calibration, by 2"),
              std::string::npos)
        << found.sentence;
  }
}

TEST_P(Contradicts, ATargetOfAnotherSizeIsToldWhereverItIs) {
  for (const double size : {0.9, 1.03, 1.2})
    for (const bool refit_target : {false, true})
      for (const Vector6d& motion : {shift(0, 0, 0), shift(0.012, -0.02, 0.01)}) {
        const Contradiction found =
            validated(GetParam(), 3, shift(0, 0, 0), motion, refit_target, size).found;
        const std::string begin = "the target is ";
        const std::size_t at = found.sentence.find(begin, found.sentence.find(": "));
        ASSERT_NE(at, std::string::npos) << found.sentence;
        EXPECT_NEAR(std::stod(found.sentence.substr(at + begin.size())), size, 0.01) << found.sentence;
      }
}

// Pairs of poses, made anew with another focal length than those of the calibration.
TEST_P(Contradicts, PosesOfAnotherLensAreToldWhereverTheTargetIs) {
  for (const double lens : {0.97, 1.05})
    for (const bool refit_target : {false, true}) {
      const HandEyeScene scene = noisy_scene(GetParam(), 0.3, 0, 5);
      const Calibration calibration = calibrate_pairs(GetParam(), pairs_of_lens(scene, 1));
      Extrinsics extrinsics = extrinsics_of(calibration, {});
      extrinsics.held_out = {calibration.held_out.deg * M_PI / 180, 1e-3 * calibration.held_out.mm};
      const std::vector<Observation> views =
          with_scales(pairs_of_lens(scene, lens), {extrinsics.target.scale, extrinsics.focal_length});
      HandEyePoses poses = calibration.poses;
      if (refit_target) poses.Z = target_pose_from(GetParam(), poses.X, views);
      const ProjectionCheck check = check_projection(GetParam(), poses, {}, {}, views, extrinsics.target, {});
      const Contradiction found = contradiction(extrinsics, poses, refit_target, {}, {}, views, check);
      const std::string begin = "the camera's focal length is ";
      const std::size_t at = found.sentence.find(begin);
      ASSERT_NE(at, std::string::npos) << found.sentence;
      EXPECT_NEAR(std::stod(found.sentence.substr(at + begin.size())), 1 / lens, 0.01) << found.sentence;
    }
}

TEST_P(Contradicts, WhatNeitherExplainsIsSaid) {
  const Contradiction found =
      validated(GetParam(), 3, shift(0.012, -0.02, 0.01), shift(-0.03, 0.02, 0.04)).found;
  EXPECT_NE(found.sentence.find("neither a target nor a camera"), std::string::npos) << found.sentence;
}

}  // namespace
}  // namespace flash::calib
