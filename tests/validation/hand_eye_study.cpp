// How accurate hand-eye calibration is, and whether its stated uncertainty is true, over seeded scenes: six
// rows of corner and robot noise, each with a closed form, the bundle and errors in variables side by side;
// then arms whose kinematic model is wrong.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "calib/uncertainty/systematic_uncertainty.h"
#include "tests/calib/arm_scene.h"

namespace flash::calib {
namespace {

struct Errors {
  std::vector<double> deg, mm;
  void add(const Eigen::Isometry3d& estimate, const Eigen::Isometry3d& truth) {
    deg.push_back(rotation_angle(estimate.linear().transpose() * truth.linear()) * 180 / M_PI);
    mm.push_back(1e3 * (estimate.translation() - truth.translation()).norm());
  }
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

/// Of the error of X in a covariance.
double squared_distance(const Refinement& refined, const HandEyePoses& truth,
                        const Eigen::MatrixXd& covariance) {
  const Vector6d error = motion_between(refined.bundle.cameras.front(), truth.X);
  return error.dot(covariance.topLeftCorner<6, 6>().ldlt().solve(error));
}

struct Row {
  Setup setup;
  double robot_deg, robot_mm;
};

void study(const Row& row, int trials, unsigned first_seed) {
  SceneSettings settings = protocol_settings(row.setup);
  settings.robot_deg = row.robot_deg;
  settings.robot_mm = row.robot_mm;
  const bool in_hand = row.setup == Setup::eye_in_hand;
  Errors closed, bundled, corrected;
  double nees = 0, corner = 0, rotation = 0, translation = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const HandEyeScene scene = make_scene(settings, in_hand ? board_points() : tag_points(),
                                          first_seed + static_cast<unsigned>(trial));
    const HandEyePoses seed = park(loops_of(scene));
    closed.add(seed.X, scene.truth.X);
    Bundle bundle =
        make_bundle(row.setup, scene.camera, scene.points, scene.observations, shah(loops_of(scene)));
    BundleSettings plain{.unknowns = {.corrections = false}, .huber = 0};
    solve_bundle(bundle, uniform_noise(bundle, 1, 1, 1, 1), plain);
    bundled.add(bundle.cameras.front(), scene.truth.X);
    const Refinement refined = refine(bundle);
    corrected.add(refined.bundle.cameras.front(), scene.truth.X);
    const Eigen::MatrixXd covariance =
        systematic_uncertainty(refined, {}, fit_pose_errors(refined, {})).covariance;
    nees += squared_distance(refined, scene.truth, covariance) / trials;
    corner += refined.noise.corner.front() / trials;
    rotation += refined.noise.rotation.front() * 180 / M_PI / trials;
    translation += refined.noise.translation.front() * 1e3 / trials;
  }
  std::printf(
      "%s %4.2f deg %4.2f mm | park %.3f/%.2f | bundle %.4f/%.3f | eiv %.4f/%.3f | nees %.2f | sigma %.3f px "
      "%.4f deg %.3f mm\n",
      in_hand ? "eih" : "eth", row.robot_deg, row.robot_mm, median(closed.deg), median(closed.mm),
      median(bundled.deg), median(bundled.mm), median(corrected.deg), median(corrected.mm), nees, corner,
      rotation, translation);
}

/// Arms whose kinematic model is wrong: what noise alone states against what holds smooth errors.
void study_arms(Setup setup, const ArmErrors& errors, double reach, int trials, unsigned first_seed) {
  constexpr double kChiSquare95 = 12.592;
  SceneSettings settings = protocol_settings(setup);
  settings.robot_deg = 0.05;
  settings.robot_mm = 0.3;
  const bool in_hand = setup == Setup::eye_in_hand;
  int found = 0, by_noise = 0, covered = 0;
  std::vector<double> noise_squared, squared;
  Errors off;
  for (int trial = 0; trial < trials; ++trial) {
    const HandEyeScene scene =
        make_arm_scene(settings, errors, reach, in_hand ? board_points() : tag_points(),
                       first_seed + static_cast<unsigned>(trial));
    const Refinement refined =
        refine(make_bundle(setup, scene.camera, scene.points, scene.observations, shah(loops_of(scene))));
    const SystematicUncertainty systematic =
        systematic_uncertainty(refined, {}, fit_pose_errors(refined, {}));
    off.add(refined.bundle.cameras.front(), scene.truth.X);
    noise_squared.push_back(squared_distance(refined, scene.truth, refined.covariance));
    squared.push_back(squared_distance(refined, scene.truth, systematic.covariance));
    found += systematic.arms.front().found;
    by_noise += noise_squared.back() < kChiSquare95;
    covered += squared.back() < kChiSquare95;
  }
  std::printf(
      "arms %s %.2f deg %.2f mm %.2f deg | reach %.1f | off %.3f/%.2f | found %d | noise %.1f %d | smooth "
      "%.1f %d of %d\n",
      in_hand ? "eih" : "eth", errors.zero_deg, errors.length_mm, errors.harmonic_deg, reach, median(off.deg),
      median(off.mm), found, median(noise_squared), by_noise, median(squared), covered, trials);
}

}  // namespace
}  // namespace flash::calib

int main(int argc, char** argv) {
  using flash::calib::Setup;
  const int trials = argc > 1 ? std::atoi(argv[1]) : 60;
  // The scenes' geometry was chosen on seeds from 1; what is reported is from others.
  const unsigned first_seed = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 1001;
  const int blocks = argc > 3 ? std::atoi(argv[3]) : 1;
  for (const Setup setup : {Setup::eye_in_hand, Setup::eye_to_hand})
    for (const auto& [deg, mm] : {std::pair{0.0, 0.0}, {0.05, 0.5}, {0.1, 1.0}})
      for (int block = 0; block < blocks; ++block)
        flash::calib::study({setup, deg, mm}, trials, first_seed + static_cast<unsigned>(block * trials));
  for (const Setup setup : {Setup::eye_in_hand, Setup::eye_to_hand})
    for (const flash::calib::ArmErrors& errors :
         {flash::calib::ArmErrors{0.1, 0.2, 0.05}, {0.2, 0.5, 0.1}, {0.5, 0.5, 0.2}})
      flash::calib::study_arms(setup, errors, setup == Setup::eye_in_hand ? 0.4 : 0.6, trials, first_seed);
}
