// Whether few views state their uncertainty truly: 4, 5, 6 and 8 pictures of a board, or pairs of poses, over
// seeded scenes of a noisy robot. SCENES FIRST_SEED
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <random>
#include <vector>

#include "calib/calibrate/calibrate_pairs.h"
#include "data/files/error.h"
#include "data/machine/parallel.h"
#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

constexpr double kDegree = M_PI / 180;

/// What a tracker says in place of pictures: poses with noise of 0.05 deg and 0.5 mm.
void blur(HandEyeScene& scene, unsigned seed) {
  std::mt19937 random(seed + 77);
  std::normal_distribution<double> normal;
  for (Observation& o : scene.observations) {
    Vector6d error;
    for (Eigen::Index k = 0; k < 6; ++k) error[k] = (k < 3 ? 0.5e-3 : 0.05 * kDegree) * normal(random);
    o.T_camera_target = {moved(o.T_camera_target.front(), error)};
    o.points.clear();
    o.pixels.resize(2, 0);
  }
}

struct Outcome {
  Vector6d error;
  Matrix6d covariance;
};

/// None of recordings that are refused.
std::optional<Outcome> outcome_of(const SceneSettings& settings, bool pairs, unsigned seed) {
  const Setup setup = settings.setup;
  HandEyeScene scene = make_scene(settings, protocol_points(setup), seed);
  if (pairs) blur(scene, seed);
  try {
    const Calibration result = pairs ? calibrate_pairs(setup, scene.observations, {})
                                     : calibrate(setup, scene.camera, scene.points,
                                                 grid_symmetries(scene.points), scene.observations);
    if (!result.usable) return std::nullopt;
    return Outcome{motion_between(result.poses.X, scene.truth.X), result.covariance};
  } catch (const data::InputError&) {
    return std::nullopt;
  }
}

void study(Setup setup, bool pairs, int views, int scenes, unsigned first_seed) {
  constexpr double kChiSquare95 = 12.592, kChiSquare999 = 22.458;
  SceneSettings settings = protocol_settings(setup);
  settings.views = views;
  settings.robot_deg = 0.05;
  settings.robot_mm = 0.5;
  std::vector<std::optional<Outcome>> outcomes(static_cast<std::size_t>(scenes));
  data::for_each_in_parallel(outcomes.size(), 0, [&](std::size_t i) {
    outcomes[i] = outcome_of(settings, pairs, first_seed + static_cast<unsigned>(i));
  });
  int solved = 0, inside = 0, far_inside = 0;
  double worst = 0, square = 0, variance = 0;
  for (const std::optional<Outcome>& outcome : outcomes) {
    if (!outcome) continue;
    ++solved;
    const auto& [error, covariance] = *outcome;
    const double distance = error.dot(covariance.ldlt().solve(error));
    inside += distance < kChiSquare95;
    far_inside += distance < kChiSquare999;
    worst = std::max(worst, error.cwiseQuotient(covariance.diagonal().cwiseSqrt()).cwiseAbs().maxCoeff());
    square += error.head<3>().squaredNorm();
    variance += covariance.topLeftCorner<3, 3>().trace();
  }
  std::printf(
      "%s, %s, %d views | answered %d of %d | inside 95 %%: %.1f %%, 99.9 %%: %.1f %% | worst axis %.1f "
      "deviations | stated over actual %.2f\n",
      to_string(setup), pairs ? "pairs" : "pictures", views, solved, scenes, 100.0 * inside / solved,
      100.0 * far_inside / solved, worst, std::sqrt(variance / square));
  std::fflush(stdout);
}

}  // namespace
}  // namespace flash::calib

int main(int argc, char** argv) {
  const int scenes = argc > 1 ? std::atoi(argv[1]) : 200;
  const unsigned first_seed = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 1300001;
  using flash::calib::Setup;
  for (const bool pairs : {true, false})
    for (const Setup setup : {Setup::eye_in_hand, Setup::eye_to_hand})
      for (const int views : {4, 5, 6, 8}) flash::calib::study(setup, pairs, views, scenes, first_seed);
}
