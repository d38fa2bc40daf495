#pragma once
#include <string>
#include <vector>

#include "calib/calibrate/cell.h"
#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {

/// One arm with a board before several cameras that stand beside it: the same robot poses in each scene,
/// corners of its own.
inline std::vector<HandEyeScene> cell_scene(int cameras, int views, unsigned seed) {
  SceneSettings settings = protocol_settings(Setup::eye_to_hand);
  settings.views = views;
  settings.robot_deg = 0.03;
  settings.robot_mm = 0.3;
  std::vector<HandEyeScene> scenes(static_cast<std::size_t>(cameras),
                                   make_scene(settings, board_points(), seed));
  for (int c = 0; c < cameras; ++c) {
    const double aside = 0.12 * (c - 0.5 * (cameras - 1));  // [m], turned back towards the board
    HandEyeScene& scene = scenes[static_cast<std::size_t>(c)];
    scene.truth.X =
        scene.truth.X * make_pose({aside, 0.3 * aside, 0}, {0, -aside / settings.distance, 0.2 * c});
  }
  return scenes;
}

/// What a camera that stands at X sees in view i, anew.
inline void look(HandEyeScene& scene, std::size_t i, const Eigen::Isometry3d& X, std::mt19937& random) {
  std::normal_distribution<double> normal;
  Observation& o = scene.observations[i];
  const Eigen::Isometry3d T = X.inverse() * scene.true_poses[i] * scene.truth.Z;
  for (Eigen::Index k = 0; k < scene.points.cols(); ++k)
    o.pixels.col(k) = project(to_vector(scene.camera), T * scene.points.col(k)) +
                      scene.settings.corner_px * Eigen::Vector2d(normal(random), normal(random));
  o.T_camera_target = {fitted_pose(scene.camera, scene.points, o.pixels, T)};
}

/// The chessboard with these corners.
inline Target target_of(const Eigen::Matrix3Xd& points) {
  const double square = points(0, 1) - points(0, 0);
  const auto columns = std::lround(points.row(0).maxCoeff() / square) + 1,
             rows = std::lround(points.row(1).maxCoeff() / square) + 1;
  return parse_target("chessboard:" + std::to_string(columns) + "x" + std::to_string(rows) + ":" +
                      std::to_string(square));
}

/// A scene calibrated by itself, a second between its views.
struct SolvedMember {
  Calibration calibration;
  CellMember member;
};
inline SolvedMember solved_member(const HandEyeScene& scene, const std::string& camera,
                                  const std::string& arm = "base", Use use = Use::workspace) {
  CalibrateSettings settings;
  settings.folds = 2;
  settings.use = use;
  SolvedMember solved{.calibration = calibrate(scene.settings.setup, scene.camera, scene.points,
                                               grid_symmetries(scene.points), scene.observations, settings),
                      .member = {}};
  Dataset dataset;
  dataset.camera = scene.camera;
  for (std::size_t i = 0; i < scene.observations.size(); ++i) {
    dataset.frames.emplace_back();
    dataset.frames.back().stamp = static_cast<double>(i);
  }
  solved.member = cell_member(arm, camera, dataset, target_of(scene.points), solved.calibration);
  return solved;
}

}  // namespace flash::calib
