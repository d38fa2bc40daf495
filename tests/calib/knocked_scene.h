#pragma once
#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {

/// Camera or target of the views from `first` to before `last` stand moved by `motion`, in its own frame,
/// from where the truth has it. Corners are seen anew, with the scene's noise.
inline void displace(HandEyeScene& scene, std::size_t first, std::size_t last, bool camera,
                     const Vector6d& motion, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  HandEyePoses then = scene.truth;
  (camera ? then.X : then.Z) = moved(camera ? then.X : then.Z, motion);
  for (std::size_t i = first; i < last; ++i) {
    Observation& o = scene.observations[i];
    const Eigen::Isometry3d& pose = scene.true_poses[i];
    const Eigen::Isometry3d T =
        then.X.inverse() * (scene.settings.setup == Setup::eye_in_hand ? pose.inverse() : pose) * then.Z;
    for (Eigen::Index k = 0; k < scene.points.cols(); ++k)
      o.pixels.col(k) = project(to_vector(scene.camera), T * scene.points.col(k)) +
                        scene.settings.corner_px * Eigen::Vector2d(normal(random), normal(random));
    o.T_camera_target = {fitted_pose(scene.camera, scene.points, o.pixels, T)};
  }
}

}  // namespace flash::calib
