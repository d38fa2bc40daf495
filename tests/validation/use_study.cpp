// What --for serves, over seeded scenes: robots whose poses are noisy, and arms whose kinematic model is
// wrong. image: held-out pixels and stated uncertainty; two-arms: two arms on one camera, against the truth;
// the lens is not quite as stated, and each arm has a print known to 0.3 %; and what a joint solution of both
// states.
// SCENES FIRST_SEED [jointly [wrong-kinematics]]
#include <Eigen/Cholesky>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "calib/calibrate/calibrate.h"
#include "data/machine/parallel.h"
#include "tests/calib/arm_scene.h"
#include "tests/calib/cell_scene.h"

namespace flash::calib {
namespace {

HandEyeScene scene_of(Setup setup, const Eigen::Matrix3Xd& points, bool wrong_kinematics, unsigned seed) {
  SceneSettings settings = protocol_settings(setup);
  settings.views = 20;
  settings.robot_deg = wrong_kinematics ? 0.005 : 0.05;  // how well an arm repeats; a noisy one
  settings.robot_mm = wrong_kinematics ? 0.03 : 0.5;
  if (!wrong_kinematics) return make_scene(settings, points, seed);
  const double reach = setup == Setup::eye_in_hand ? 0.4 : 0.6;
  return make_arm_scene(settings, {.zero_deg = 0.1, .length_mm = 0.5}, reach, points, seed);
}

Calibration solved(const HandEyeScene& scene, const data::CameraIntrinsics& camera, Use use, int folds) {
  CalibrateSettings settings;
  settings.use = use;
  settings.folds = folds;
  return calibrate(scene.settings.setup, camera, scene.points, grid_symmetries(scene.points),
                   scene.observations, settings);
}

const char* name_of(bool wrong_kinematics) { return wrong_kinematics ? "wrong kinematics" : "white noise"; }

void study_image(Setup setup, bool wrong_kinematics, int scenes, unsigned first_seed) {
  constexpr double kChiSquare95 = 12.592;
  std::vector<Calibration> results(static_cast<std::size_t>(scenes));
  std::vector<Vector6d> errors(results.size());
  data::for_each_in_parallel(results.size(), 0, [&](std::size_t i) {
    const HandEyeScene scene =
        scene_of(setup, protocol_points(setup), wrong_kinematics, first_seed + static_cast<unsigned>(i));
    results[i] = solved(scene, scene.camera, Use::image, 5);
    errors[i] = motion_between(results[i].poses.X, scene.truth.X);
  });
  int fewest = 0, inside = 0;
  std::map<std::string, double> px;
  for (std::size_t i = 0; i < results.size(); ++i) {
    const Calibration& result = results[i];
    for (const ComparedMethod& method : result.comparison)
      if (method.held_out) px[method.name] += std::pow(method.held_out->px, 2) / scenes;
    px["answer"] += std::pow(result.held_out.px, 2) / scenes;
    fewest += result.method == Method::pixels;
    inside += errors[i].dot(result.covariance.ldlt().solve(errors[i])) < kChiSquare95;
  }
  std::printf("image, %s, %s: held out px", to_string(setup), name_of(wrong_kinematics));
  for (const auto& [name, square] : px) std::printf(" %s %.3f", name.c_str(), std::sqrt(square));
  std::printf(" | fewest pixels in %d, truth inside 95 %% in %d of %d\n", fewest, inside, scenes);
  std::fflush(stdout);
}

/// By method, the squared distance between two arms' places for one point [m^2].
std::map<std::string, double> between_arms(bool wrong_kinematics, double lens_sd, unsigned first_seed,
                                           unsigned number) {
  const Eigen::Matrix3Xd points = board_points(7, 5, 0.03);
  std::mt19937 random(first_seed + number);
  const double off = 1 + lens_sd * std::normal_distribution<double>()(random);
  std::map<std::string, std::vector<Eigen::Isometry3d>> X;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  // of what the second arm holds, in its base
  for (unsigned arm = 0; arm < 2; ++arm) {
    const double size = 1 + usual_size_sd(points) * std::normal_distribution<double>()(random);
    HandEyeScene scene =
        scene_of(Setup::eye_to_hand, size * points, wrong_kinematics, first_seed + 2 * number + arm);
    scene.points = points;
    data::CameraIntrinsics camera = scene.camera;
    camera.fx *= off;
    camera.fy *= off;
    middle.setZero();
    for (Observation& o : scene.observations) {
      middle += scene.truth.X * (o.T_camera_target.front() * points.rowwise().mean()) / scene.settings.views;
      o.T_camera_target = {fitted_pose(camera, points, o.pixels, o.T_camera_target.front())};
    }
    X["truth"].push_back(scene.truth.X);
    X["workspace"].push_back(solved(scene, camera, Use::workspace, 2).poses.X);
    const Calibration result = solved(scene, camera, Use::two_arms, 2);
    X["two-arms"].push_back(result.poses.X);
    for (const ComparedMethod& method : result.comparison)
      if (method.held_out) X[method.name].push_back(method.poses.X);
  }
  X.erase("errors_in_variables");
  const auto at = [&](const std::vector<Eigen::Isometry3d>& arms) -> Eigen::Vector3d {
    return arms[0] * (arms[1].inverse() * middle);
  };
  std::map<std::string, double> squares;
  for (const auto& [name, arms] : X) squares[name] = (at(arms) - at(X["truth"])).squaredNorm();
  return squares;
}

/// How far two arms that are solved jointly lie from the truth, over what is stated, at a point in their
/// workspace.
struct Stated {
  double square = 0;    ///< mean over the axes of squared error over variance
  double distance = 0;  ///< squared, of the whole pose in the stated covariance
  bool usable = false;
};

Stated stated_of_arms(Use use, bool wrong_kinematics, double lens_sd, unsigned first_seed, unsigned number) {
  const Eigen::Matrix3Xd points = board_points(7, 5, 0.03);
  std::mt19937 random(first_seed + number);
  const double off = 1 + lens_sd * std::normal_distribution<double>()(random);
  std::vector<CellMember> members;
  std::vector<Eigen::Isometry3d> truth;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  // of what the second arm holds, in its base
  for (unsigned arm = 0; arm < 2; ++arm) {
    const double size = 1 + usual_size_sd(points) * std::normal_distribution<double>()(random);
    HandEyeScene scene =
        scene_of(Setup::eye_to_hand, size * points, wrong_kinematics, first_seed + 2 * number + arm);
    scene.points = points;
    scene.camera.fx *= off;
    scene.camera.fy *= off;
    middle.setZero();
    for (Observation& o : scene.observations) {
      o.T_camera_target = {fitted_pose(scene.camera, points, o.pixels, o.T_camera_target.front())};
      middle += scene.truth.X * (o.T_camera_target.front() * points.rowwise().mean()) / scene.settings.views;
    }
    truth.push_back(scene.truth.X);
    members.push_back(solved_member(scene, "camera", arm == 0 ? "left" : "right", use).member);
  }
  CellSettings settings;
  if (use == Use::two_arms) settings.lens = LensKnowledge::stated;
  const Cell cell = solve_cell(members, settings);
  const CellFrame& base = cell.bases.front();
  const Eigen::Isometry3d there = truth[0] * truth[1].inverse();
  const Vector6d error = motion_between(base.transform.T, there);
  const Eigen::Vector3d apart = base.transform.T * middle - there * middle;
  return {.square = (apart.array().square() / point_covariance(base, middle).diagonal().array()).mean(),
          .distance = error.dot(base.covariance.ldlt().solve(error)),
          .usable = cell.usable};
}

void study_stated(Use use, bool wrong_kinematics, double lens_sd, int scenes, unsigned first_seed) {
  constexpr double kChiSquare95 = 12.592;
  std::vector<Stated> all(static_cast<std::size_t>(scenes));
  data::for_each_in_parallel(all.size(), 0, [&](std::size_t i) {
    all[i] = stated_of_arms(use, wrong_kinematics, lens_sd, first_seed, static_cast<unsigned>(i));
  });
  double squares = 0;
  int inside = 0, usable = 0;
  for (const Stated& one : all) {
    squares += one.square / scenes;
    inside += one.distance < kChiSquare95;
    usable += one.usable;
  }
  std::printf(
      "two arms jointly, %s, %s, lens stated to %.1f %%: error over stated deviation %.2f (rms), truth "
      "inside "
      "95 %% in %d of %d, usable %d\n",
      to_string(use), name_of(wrong_kinematics), 100 * lens_sd, std::sqrt(squares), inside, scenes, usable);
  std::fflush(stdout);
}

void study_arms(bool wrong_kinematics, double lens_sd, int scenes, unsigned first_seed) {
  std::vector<std::map<std::string, double>> all(static_cast<std::size_t>(scenes));
  data::for_each_in_parallel(all.size(), 0, [&](std::size_t i) {
    all[i] = between_arms(wrong_kinematics, lens_sd, first_seed, static_cast<unsigned>(i));
  });
  std::map<std::string, double> squares;
  for (const std::map<std::string, double>& one : all)
    for (const auto& [name, square] : one) squares[name] += square / scenes;
  std::printf("two arms, %s, lens stated to %.1f %%: mm", name_of(wrong_kinematics), 100 * lens_sd);
  for (const auto& [name, square] : squares)
    if (name != "truth") std::printf(" %s %.2f", name.c_str(), 1e3 * std::sqrt(square));
  std::printf(" of %d\n", scenes);
  std::fflush(stdout);
}

}  // namespace
}  // namespace flash::calib

int main(int argc, char** argv) {
  const int scenes = argc > 1 ? std::atoi(argv[1]) : 100;
  // Settings were chosen on seeds below 500,100 and from 910,001 to 922,000.
  const unsigned first_seed = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 600001;
  const bool jointly = argc > 3 && std::string(argv[3]) == "jointly";  // that alone
  using flash::calib::Setup;
  const bool wrong_alone = argc > 4 && std::string(argv[4]) == "wrong-kinematics";
  for (const bool wrong_kinematics : {false, true}) {
    if (wrong_alone && !wrong_kinematics) continue;
    for (const Setup setup : {Setup::eye_in_hand, Setup::eye_to_hand})
      if (!jointly) flash::calib::study_image(setup, wrong_kinematics, scenes, first_seed);
    for (const double lens_sd : {0.0, 0.002, 0.005}) {
      if (!jointly) flash::calib::study_arms(wrong_kinematics, lens_sd, scenes, first_seed);
      for (const flash::calib::Use use : {flash::calib::Use::workspace, flash::calib::Use::two_arms})
        flash::calib::study_stated(use, wrong_kinematics, lens_sd, scenes, first_seed);
    }
  }
}
