// Whether a calibration that knows the size of its target as a ruler tells it, and its lens to 0.5 %, states
// its uncertainty truly, over seeded scenes: robots whose poses are noisy, arms whose kinematic model is
// wrong, and arms of both.
//   size_study [SCENES [FIRST_SEED [KIND [exact-lens | kept-size]]]]
// KIND is one of the rows, as "eye-to-hand white noise", or empty: all. exact-lens: the lens is as stated,
// which the calibration does not know. kept-size: --target-size stated, of prints as they are.
#include <Eigen/Cholesky>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "calib/calibrate/calibrate.h"
#include "data/machine/parallel.h"
#include "tests/calib/arm_scene.h"

namespace flash::calib {
namespace {

/// Focal lengths and centre as stated of a lens that has those of `camera`: off by what usual_lens_prior
/// expects.
data::CameraIntrinsics stated_lens(data::CameraIntrinsics camera, std::mt19937& random) {
  constexpr double kShare = 0.005;
  std::normal_distribution<double> normal;
  const double half_diagonal = 0.5 * std::hypot(camera.width, camera.height);
  for (double* length : {&camera.fx, &camera.fy}) *length *= 1 + kShare * normal(random);
  for (double* centre : {&camera.cx, &camera.cy}) *centre += kShare * half_diagonal * normal(random);
  return camera;
}

/// The scene with a print that is `size` times as large as stated, and a lens that is not quite as stated.
HandEyeScene stated(HandEyeScene scene, double size, bool lens_as_stated, unsigned seed) {
  std::mt19937 random(seed + 1'000'000'000);
  if (!lens_as_stated) scene.camera = stated_lens(scene.camera, random);
  scene.points /= size;
  for (Observation& o : scene.observations)
    o.T_camera_target = {
        fitted_pose(scene.camera, scene.points(Eigen::all, o.points), o.pixels, o.T_camera_target.front())};
  return scene;
}

struct Errors {
  const char* name;
  double robot_deg, robot_mm;  ///< noise of each pose: of arms, how well they repeat
  ArmErrors model;             ///< none: no arm
};

constexpr Errors kErrors[] = {{"white noise", 0.05, 0.5, {.zero_deg = 0, .length_mm = 0}},
                              {"wrong kinematics", 0.005, 0.03, {.zero_deg = 0.1, .length_mm = 0.5}},
                              {"both", 0.03, 0.2, {.zero_deg = 0.05, .length_mm = 0.3}}};

HandEyeScene scene_of(Setup setup, const Errors& errors, bool lens_as_stated, double size, unsigned seed) {
  SceneSettings settings = protocol_settings(setup);
  const Eigen::Matrix3Xd points = size * protocol_points(setup);
  settings.robot_deg = errors.robot_deg;
  settings.robot_mm = errors.robot_mm;
  const double reach = setup == Setup::eye_in_hand ? 0.4 : 0.6;
  HandEyeScene scene = errors.model.zero_deg > 0 ? make_arm_scene(settings, errors.model, reach, points, seed)
                                                 : make_scene(settings, points, seed);
  return stated(std::move(scene), size, lens_as_stated, seed);
}

std::string kind(Setup setup, const Errors& errors) {
  return to_string(setup) + std::string(" ") + errors.name;
}

struct Outcome {
  Vector6d error, variances;
  double distance = 0;  ///< squared, of the truth in the stated covariance
  bool usable = false, whole = false;
};

Outcome outcome_of(Setup setup, const Errors& errors, bool lens_as_stated, const CalibrateSettings& settings,
                   unsigned seed) {
  std::mt19937 random(seed);
  const double size = 1 + usual_size_sd(protocol_points(setup)) * std::normal_distribution<double>()(random);
  const HandEyeScene scene = scene_of(setup, errors, lens_as_stated, size, seed);
  const Calibration result = calibrate(setup, scene.camera, scene.points, grid_symmetries(scene.points),
                                       scene.observations, settings);
  const Vector6d error = motion_between(result.poses.X, scene.truth.X);
  return {.error = error,
          .variances = result.covariance.diagonal(),
          .distance = error.dot(result.covariance.ldlt().solve(error)),
          .usable = result.usable,
          .whole = result.used.size() == scene.observations.size()};
}

void study(Setup setup, const Errors& errors, bool lens_as_stated, bool kept_size, int scenes,
           unsigned first_seed) {
  constexpr double kChiSquare95 = 12.592, kChiSquare999 = 22.458;
  CalibrateSettings settings;
  settings.folds = 2;
  settings.size_as_stated = kept_size;
  std::vector<Outcome> outcomes(static_cast<std::size_t>(scenes));
  data::for_each_in_parallel(outcomes.size(), 0, [&](std::size_t i) {
    outcomes[i] = outcome_of(setup, errors, lens_as_stated, settings, first_seed + static_cast<unsigned>(i));
  });
  int inside = 0, far_inside = 0, solved = 0, whole = 0;
  Vector6d squares = Vector6d::Zero(), variances = Vector6d::Zero();
  for (const Outcome& outcome : outcomes) {
    inside += outcome.distance < kChiSquare95;
    far_inside += outcome.distance < kChiSquare999;
    squares += outcome.error.cwiseAbs2() / scenes;
    variances += outcome.variances / scenes;
    solved += outcome.usable;
    whole += outcome.whole;
  }
  const auto rms = [](const Vector6d& v, Eigen::Index first, double unit) {
    return unit * std::sqrt(v.segment<3>(first).sum());
  };
  std::printf(
      "%-28s | inside %5.1f %% of %d, of 99.9 %%: %.1f %% | off %.3f mm %.4f deg | stated %.3f mm %.4f deg | "
      "stated over "
      "actual "
      "%.2f %.2f | usable %d, with all views %d\n",
      kind(setup, errors).c_str(), 100.0 * inside / scenes, scenes, 100.0 * far_inside / scenes,
      rms(squares, 0, 1e3), rms(squares, 3, 180 / M_PI), rms(variances, 0, 1e3),
      rms(variances, 3, 180 / M_PI), rms(variances, 0, 1) / rms(squares, 0, 1),
      rms(variances, 3, 1) / rms(squares, 3, 1), solved, whole);
  std::fflush(stdout);
}

}  // namespace
}  // namespace flash::calib

int main(int argc, char** argv) {
  const int scenes = argc > 1 ? std::atoi(argv[1]) : 200;
  // Settings were chosen on seeds below 80,000.
  const unsigned first_seed = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 100001;
  const std::string only = argc > 3 ? argv[3] : "";
  const bool lens_as_stated = argc > 4 && std::string(argv[4]) == "exact-lens";
  const bool kept_size = argc > 4 && std::string(argv[4]) == "kept-size";
  using flash::calib::Setup;
  for (const Setup setup : {Setup::eye_in_hand, Setup::eye_to_hand})
    for (const flash::calib::Errors& errors : flash::calib::kErrors)
      if (only.empty() || only == flash::calib::kind(setup, errors))
        flash::calib::study(setup, errors, lens_as_stated, kept_size, scenes, first_seed);
}
