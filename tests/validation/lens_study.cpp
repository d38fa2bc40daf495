// Whether a calibration states truly how well it knows the lens that it solves for, and what another
// recording would differ by, over seeded rigs of two recordings each: prints that bend otherwise in each
// view, lenses of another model, arms whose kinematic model is wrong.
//   lens_study [RIGS [FIRST_SEED [KIND]]]
#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "calib/calibrate/calibrate.h"
#include "data/files/error.h"
#include "data/machine/parallel.h"
#include "tests/calib/arm_scene.h"

namespace flash::calib {
namespace {

constexpr int kViews = 20;  // of a recording

struct Kind {
  const char* name;
  double bend_mm = 0;   ///< of the print, in each view
  double rational = 0;  ///< k4 of the lens, which is not solved for
  double zero_deg = 0;  ///< of the arm's joints; 0: its poses are noisy alone
};
constexpr Kind kKinds[] = {{"as modelled"},
                           {.name = "bending print", .bend_mm = 0.5},
                           {.name = "another lens model", .rational = 0.15},
                           {.name = "wrong kinematics", .zero_deg = 0.05}};

/// Both recordings of a rig, one after the other.
HandEyeScene rig_of(const Kind& kind, unsigned seed) {
  SceneSettings settings = protocol_settings(Setup::eye_in_hand);
  settings.views = 2 * kViews;
  const bool arm = kind.zero_deg > 0;
  settings.robot_deg = arm ? 0.01 : 0.03;
  settings.robot_mm = arm ? 0.05 : 0.3;
  HandEyeScene scene =
      arm ? make_arm_scene(settings, {.zero_deg = kind.zero_deg, .length_mm = 0.2}, 0.4, board_points(), seed)
          : make_scene(settings, board_points(), seed);
  data::CameraIntrinsics& lens = scene.camera;
  lens.model = data::DistortionModel::rational_polynomial;
  lens.distortion = {-0.1, 0.02, 0, 0, 0, kind.rational, 0, 0};
  std::mt19937 random(seed + 1'000'000'000);
  std::normal_distribution<double> normal;
  const Bows bows = target_bows(scene.points);
  for (std::size_t i = 0; i < scene.observations.size(); ++i) {
    Observation& o = scene.observations[i];
    const Eigen::Isometry3d T = scene.truth.X.inverse() * scene.true_poses[i].inverse() * scene.truth.Z;
    Warp warp;
    for (double& bend : warp) bend = 1e-3 * kind.bend_mm * normal(random);
    const Eigen::Matrix3Xd points = shaped(scene.points, bows, {.warp = warp});
    for (Eigen::Index k = 0; k < points.cols(); ++k)
      o.pixels.col(k) = project(to_vector(lens), T * points.col(k)) +
                        settings.corner_px * Eigen::Vector2d(normal(random), normal(random));
  }
  return scene;
}

/// A lens as people state it: off by half a percent, without its distortion of higher order.
data::CameraIntrinsics stated_lens(data::CameraIntrinsics camera, unsigned seed) {
  constexpr double kShare = 0.005;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  camera.model = data::DistortionModel::plumb_bob;
  camera.distortion = {-0.1, 0.02, 0, 0, 0};
  for (double* length : {&camera.fx, &camera.fy}) *length *= 1 + kShare * normal(random);
  for (double* centre : {&camera.cx, &camera.cy}) *centre += 400 * kShare * normal(random);
  return camera;
}

struct Outcome {
  bool solved = false;
  Eigen::Array4d lens = Eigen::Array4d::Zero();  ///< squared errors of fx fy cx cy over their variances
  double answer = 0;                             ///< squared distance of X from the truth, as stated
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  Matrix6d repeatable = Matrix6d::Zero();
  double factor = 1;
};

Outcome outcome_of(const HandEyeScene& rig, int recording, unsigned seed) {
  const data::CameraIntrinsics camera = stated_lens(rig.camera, seed);
  std::vector<Observation> views(rig.observations.begin() + recording * kViews,
                                 rig.observations.begin() + (recording + 1) * kViews);
  for (Observation& o : views)
    o.T_camera_target = {fitted_pose(camera, rig.points, o.pixels, o.T_camera_target.front())};
  CalibrateSettings settings;
  settings.folds = 2;
  try {
    const Calibration result =
        calibrate(rig.settings.setup, camera, rig.points, grid_symmetries(rig.points), views, settings);
    const Eigen::Array4d off = (result.lens.estimate - to_vector(rig.camera)).head<4>().array();
    const Vector6d error = motion_between(result.poses.X, rig.truth.X);
    return {.solved = true,
            .lens = (off / result.lens.sd.head<4>().array()).square(),
            .answer = error.dot(result.covariance.ldlt().solve(error)),
            .X = result.poses.X,
            .repeatable = result.repeatable,
            .factor = result.lens_view_factor};
  } catch (const data::InputError&) {
    return {};
  }
}

void study(const Kind& kind, int rigs, unsigned first_seed) {
  constexpr double kChiSquare95 = 12.592, kChiSquare95Of1 = 3.841;
  std::vector<std::array<Outcome, 2>> all(static_cast<std::size_t>(rigs));
  data::for_each_in_parallel(all.size(), 0, [&](std::size_t i) {
    const unsigned seed = first_seed + static_cast<unsigned>(i);
    const HandEyeScene rig = rig_of(kind, seed);
    for (int k = 0; k < 2; ++k) all[i][static_cast<std::size_t>(k)] = outcome_of(rig, k, seed);
  });
  int solved = 0, inside = 0, pairs = 0, apart_inside = 0;
  Eigen::Array4d lens_inside = Eigen::Array4d::Zero(), lens_squares = lens_inside;
  double apart_squares = 0, factors = 0;
  for (const std::array<Outcome, 2>& both : all) {
    for (const Outcome& outcome : both) {
      if (!outcome.solved) continue;
      ++solved;
      inside += outcome.answer < kChiSquare95;
      lens_inside += (outcome.lens < kChiSquare95Of1).cast<double>();
      lens_squares += outcome.lens;
      factors += outcome.factor;
    }
    if (!both[0].solved || !both[1].solved) continue;
    const Vector6d apart = motion_between(both[0].X, both[1].X);
    const double distance = apart.dot((both[0].repeatable + both[1].repeatable).ldlt().solve(apart));
    ++pairs;
    apart_inside += distance < kChiSquare95;
    apart_squares += distance / 6;
  }
  const Eigen::Array4d share = 100 * lens_inside / solved, mean = lens_squares / solved;
  std::printf(
      "%-20s | %d recordings; inside 95 %%: fx %.0f fy %.0f cx %.0f cy %.0f %%, X %.0f %%; mean squares fx "
      "%.2f fy "
      "%.2f cx %.2f cy %.2f; lens factor %.2f | two recordings inside 95 %% of repeatable: %.0f %% of %d, "
      "mean "
      "square %.2f\n",
      kind.name, solved, share[0], share[1], share[2], share[3], 100.0 * inside / solved, mean[0], mean[1],
      mean[2], mean[3], factors / solved, 100.0 * apart_inside / pairs, pairs, apart_squares / pairs);
  std::fflush(stdout);
}

}  // namespace
}  // namespace flash::calib

int main(int argc, char** argv) {
  const int rigs = argc > 1 ? std::atoi(argv[1]) : 60;
  const unsigned first_seed = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 700001;
  const std::string only = argc > 3 ? argv[3] : "";
  for (const flash::calib::Kind& kind : flash::calib::kKinds)
    if (only.empty() || only == kind.name) flash::calib::study(kind, rigs, first_seed);
}
