#pragma once
#include <Eigen/Cholesky>
#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "calib/calibrate/calibrate_pairs.h"
#include "calib/geometry/pose_from_pixels.h"
#include "tests/calib/knocked_scene.h"

namespace flash::calib {

/// Robot and camera as they stand, with noise of each.
inline HandEyeScene noisy_scene(Setup setup, double robot_mm, double camera_mm, unsigned seed) {
  SceneSettings settings = protocol_settings(setup);
  settings.views = 24;
  settings.robot_mm = robot_mm;
  settings.robot_deg = 0.02;
  HandEyeScene scene = make_scene(settings, board_points(), seed);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (Observation& pair : scene.observations)
    for (double& value : pair.T_camera_target.front().translation())
      value += 1e-3 * camera_mm * normal(random);
  return scene;
}

inline bool within_999(const Calibration& result, const HandEyeScene& scene) {
  const Vector6d error = motion_between(result.poses.X, scene.truth.X);
  return error.dot(result.covariance.ldlt().solve(error)) < 22.5;  // 99.9 % of chi-square, 6
}

inline bool tells_of_size(const Calibration& result) {
  return std::any_of(result.warnings.begin(), result.warnings.end(), [](const std::string& warning) {
    return warning.find("times as large as stated") != std::string::npos;
  });
}

/// With poses of the target that a camera made whose focal length was stated so many times too long.
inline std::vector<Observation> pairs_of_lens(const HandEyeScene& scene, double too_long) {
  std::vector<Observation> pairs = pairs_of(scene);
  data::CameraIntrinsics camera = scene.camera;
  camera.fx *= too_long;
  camera.fy *= too_long;
  // About the middle a wrong focal length leaves how deep the target is.
  const Eigen::Translation3d middle(scene.points.rowwise().mean());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Observation& view = scene.observations[i];
    pairs[i].T_camera_target = {fitted_pose(camera, scene.points(Eigen::all, view.points), view.pixels,
                                            view.T_camera_target.front()) *
                                middle};
  }
  return pairs;
}

inline bool tells_of_lens(const Calibration& result) {
  return std::any_of(result.warnings.begin(), result.warnings.end(), [](const std::string& warning) {
    return warning.starts_with("the camera's focal length is ");
  });
}

}  // namespace flash::calib
