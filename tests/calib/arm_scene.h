#pragma once
#include <array>

#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {

/// Revolute joints by Denavit and Hartenberg, each with a zero and a harmonic of its gear.
struct Arm {
  struct Joint {
    double a = 0, d = 0, alpha = 0;                     ///< [m, m, rad]
    double zero = 0, harmonic = 0, harmonic_phase = 0;  ///< [rad]
  };
  std::array<Joint, 6> joints;

  Eigen::Isometry3d pose(const Eigen::Matrix<double, 6, 1>& q) const {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    for (Eigen::Index i = 0; i < 6; ++i) {
      const Joint& joint = joints[static_cast<std::size_t>(i)];
      const double angle = q[i] + joint.zero + joint.harmonic * std::sin(q[i] + joint.harmonic_phase);
      T = T * Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()) * Eigen::Translation3d(joint.a, 0, joint.d) *
          Eigen::AngleAxisd(joint.alpha, Eigen::Vector3d::UnitX());
    }
    return T;
  }
};

/// The proportions of a UR5: 0.85 m of reach.
inline Arm nominal_arm() {
  return {{{{0, 0.0892, M_PI / 2},
            {-0.425, 0, 0},
            {-0.3923, 0, 0},
            {0, 0.1092, M_PI / 2},
            {0, 0.0947, -M_PI / 2},
            {0, 0.0823, 0}}}};
}

/// An arm that is not what its model says, standard deviations of each joint.
struct ArmErrors {
  double zero_deg = 0;      ///< of a joint's zero; half of it of its axis' direction
  double length_mm = 0;     ///< of a link
  double harmonic_deg = 0;  ///< of a gear
};

/// Views of a target by an arm with errors: its poses are what its nominal model makes of its joints, with
/// independent noise of `settings` on top. Joints move up to `reach` [rad] either way of a random middle.
inline HandEyeScene make_arm_scene(const SceneSettings& settings, const ArmErrors& errors, double reach,
                                   const Eigen::Matrix3Xd& points, unsigned seed) {
  HandEyeScene scene;
  scene.settings = settings;
  scene.points = points;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::normal_distribution<double> normal;
  const auto uniform3 = [&] { return Eigen::Vector3d(uniform(random), uniform(random), uniform(random)); };
  const auto normal3 = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  constexpr double kDegree = M_PI / 180;
  const Arm nominal = nominal_arm();
  Arm arm = nominal;
  for (Arm::Joint& joint : arm.joints) {
    joint.zero = errors.zero_deg * kDegree * normal(random);
    joint.alpha += 0.5 * errors.zero_deg * kDegree * normal(random);
    joint.a += 1e-3 * errors.length_mm * normal(random);
    joint.d += 1e-3 * errors.length_mm * normal(random);
    joint.harmonic = errors.harmonic_deg * kDegree * normal(random);
    joint.harmonic_phase = M_PI * uniform(random);
  }
  Eigen::Matrix<double, 6, 1> middle, q;
  middle << 0.3, -1.6, 1.6, -1.57, -1.57, 0;
  for (Eigen::Index i = 0; i < 6; ++i) middle[i] += 0.3 * uniform(random);
  const bool in_hand = settings.setup == Setup::eye_in_hand;
  const Eigen::Vector3d centre = points.rowwise().mean();
  const Eigen::Isometry3d in_gripper =
      make_pose(Eigen::Vector3d(0.05, 0.02, 0.08) + 0.03 * uniform3(), 0.5 * uniform3());
  Eigen::Isometry3d T_camera_target = make_pose(Eigen::Vector3d::Zero(), 0.3 * uniform3());
  T_camera_target.translation() =
      Eigen::Vector3d(0, 0, settings.distance) - T_camera_target.linear() * centre;
  const Eigen::Isometry3d in_world =
      arm.pose(middle) * in_gripper * (in_hand ? T_camera_target : T_camera_target.inverse());
  scene.truth = in_hand ? HandEyePoses{in_gripper, in_world} : HandEyePoses{in_world, in_gripper};
  while (scene.observations.size() < static_cast<std::size_t>(settings.views)) {
    for (Eigen::Index i = 0; i < 6; ++i) q[i] = middle[i] + reach * uniform(random);
    const Eigen::Isometry3d pose = arm.pose(q);
    T_camera_target = in_hand ? scene.truth.X.inverse() * pose.inverse() * scene.truth.Z
                              : scene.truth.X.inverse() * pose * scene.truth.Z;
    if (T_camera_target.linear()(2, 2) < 0.5) continue;  // seen at less than 30 degrees
    Observation observation;
    observation.pixels.resize(2, points.cols());
    bool visible = true;
    for (Eigen::Index k = 0; k < points.cols() && visible; ++k) {
      const Eigen::Vector3d p = T_camera_target * points.col(k);
      visible = p.z() > 0.1;
      if (!visible) break;
      const Eigen::Vector2d pixel = project(to_vector(scene.camera), p);
      visible = pixel.minCoeff() > 5 && pixel.x() < 635 && pixel.y() < 475;
      observation.points.push_back(static_cast<int>(k));
      observation.pixels.col(k) =
          pixel + settings.corner_px * Eigen::Vector2d(normal(random), normal(random));
    }
    if (!visible) continue;
    Vector6d noise;
    noise << settings.robot_mm * 1e-3 * normal3(), settings.robot_deg * kDegree * normal3();
    observation.T_base_gripper = moved(nominal.pose(q), noise);
    observation.image = std::to_string(scene.observations.size());
    observation.T_camera_target = {fitted_pose(scene.camera, points, observation.pixels, T_camera_target)};
    scene.observations.push_back(std::move(observation));
    scene.true_poses.push_back(pose);
    scene.joints.emplace_back(q);
  }
  return scene;
}

}  // namespace flash::calib
