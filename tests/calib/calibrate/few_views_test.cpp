// Four to six views say little of their own noise.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "calib/calibrate/calibrate_pairs.h"
#include "data/files/error.h"
#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

constexpr double kChiSquare95 = 12.592;

struct Count {
  int answered = 0, inside = 0;
};

template <class Solve>
Count count_inside(Setup setup, int views, unsigned first_seed, const Solve& solve) {
  constexpr unsigned kScenes = 60;
  SceneSettings settings = protocol_settings(setup);
  settings.views = views;
  settings.robot_deg = 0.05;
  settings.robot_mm = 0.5;
  Count count;
  for (unsigned seed = first_seed; seed < first_seed + kScenes; ++seed) {
    const HandEyeScene scene = make_scene(settings, protocol_points(setup), seed);
    try {
      const Calibration result = solve(scene);
      if (!result.usable || (result.along && !result.along->told)) continue;
      const Vector6d error = motion_between(result.poses.X, scene.truth.X);
      ++count.answered;
      count.inside += error.dot(result.covariance.ldlt().solve(error)) < kChiSquare95;
    } catch (const data::InputError&) {
      continue;  // hardly turns, by chance
    }
  }
  return count;
}

// 0.95 less three standard deviations of sixty draws: sqrt(0.95 0.05 / 60) = 0.028.
constexpr double kLeast = 0.865;

TEST(FewViews, OfPairsHoldTheTruthInTheirRegion) {
  for (const int views : {4, 5}) {
    const Count count = count_inside(Setup::eye_in_hand, views, 31001, [](HandEyeScene scene) {
      for (Observation& o : scene.observations) {
        o.points.clear();
        o.pixels.resize(2, 0);
      }
      return calibrate_pairs(Setup::eye_in_hand, scene.observations);
    });
    EXPECT_GT(count.answered, 45);
    EXPECT_GE(count.inside, kLeast * count.answered) << views;
  }
}

TEST(FewViews, OfATagHoldTheTruthInTheirRegion) {
  CalibrateSettings settings;
  settings.folds = 2;
  for (const int views : {4, 5}) {
    const Count count = count_inside(Setup::eye_to_hand, views, 32001, [&](const HandEyeScene& scene) {
      return calibrate(Setup::eye_to_hand, scene.camera, scene.points, grid_symmetries(scene.points),
                       scene.observations, settings);
    });
    EXPECT_GT(count.answered, 45);
    EXPECT_GE(count.inside, kLeast * count.answered) << views;
  }
}

}  // namespace
}  // namespace flash::calib
