#pragma once
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "calib/geometry/setup.h"

namespace flash::calib {

/// One view of the closed chain G X C = Z: C = T_camera_target, and G = T_base_gripper (eye-in-hand) or its
/// inverse (eye-to-hand). X and Z as in Setup.
struct PoseLoop {
  Eigen::Isometry3d G = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d C = Eigen::Isometry3d::Identity();
};
PoseLoop pose_loop(Setup setup, const Eigen::Isometry3d& T_base_gripper,
                   const Eigen::Isometry3d& T_camera_target);

struct HandEyePoses {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d Z = Eigen::Isometry3d::Identity();
};

/// Park and Martin 1994: rotation from the logarithms of all relative rotations, eq. 11 (here the nearest
/// rotation, by singular values), then translation by least squares. Z: mean of G X C.
/// Needs three views whose rotations do not all share one axis; otherwise the result means nothing.
HandEyePoses park(const std::vector<PoseLoop>& loops);

/// Shah 2013: both rotations from the dominant singular vectors of sum kron(R_G, R_C), then both translations
/// by least squares.
HandEyePoses shah(const std::vector<PoseLoop>& loops);

/// As Park and Martin's for turns of nearly half a circle, whose logarithms have either sign: of both signs
/// of each motion's the solution that closes best, its translations by least squares. Of three views.
HandEyePoses half_turns(const std::vector<PoseLoop>& loops);

/// Of views that turn about one axis alone. The axis, as the gripper and as the camera see it, tells all of
/// X's rotation but the turn about it; that comes with both translations, by least squares, of how the
/// gripper moves. What is left of the translations along the axis is the shortest.
HandEyePoses of_one_axis(const std::vector<PoseLoop>& loops);

/// How far Z^-1 G X C is from the identity.
struct ClosingError {
  double rotation = 0;     ///< [rad]
  double translation = 0;  ///< [m]
};
ClosingError closing_error(const PoseLoop& loop, const HandEyePoses& poses);
ClosingError closing_rms(const std::vector<PoseLoop>& loops, const HandEyePoses& poses);

/// The one that closes better, turns and translations taken over the distance to the target.
HandEyePoses better_of(const std::vector<PoseLoop>& loops, const HandEyePoses& a, const HandEyePoses& b);

/// The same between all pairs of views, of A X = X B with A = G_j^-1 G_i, B = C_j C_i^-1: free of Z.
ClosingError relative_rms(const std::vector<PoseLoop>& loops, const Eigen::Isometry3d& X);

/// By how much the translations of C would have to grow for the chain to close best: true over stated size of
/// the target, or of metres over the robot's unit. By least squares together with both translations.
double translation_scale(const std::vector<PoseLoop>& loops, const HandEyePoses& poses);

}  // namespace flash::calib
