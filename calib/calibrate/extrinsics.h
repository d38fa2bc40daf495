#pragma once
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calib/calibrate/calibrate.h"
#include "calib/detect/read_depth.h"
#include "calib/solve/time_offset.h"
#include "data/extrinsics.h"

namespace flash::calib {

using data::NamedTransform;

/// What a calibration was made from, so that it can be made again, and what took part beside the corners.
struct ExtrinsicsInputs {
  std::string dataset, target, poses, camera, refiner;
  std::optional<DepthUse> depth = {};
  std::optional<TimeOffset> time_offset = {};
};

/// The same with paths as a reader of the file `out` needs them: relative to its folder, so that file and
/// dataset can be moved together. Nothing changes where `out` is empty.
ExtrinsicsInputs relative_to(ExtrinsicsInputs inputs, const std::string& out);

/// A path of the provenance: from the folder of the calibration, else from the current one. Throws
/// data::InputError where it is at neither.
std::string resolved(const std::string& path, const std::string& calibration);

/// "flash-extrinsics/1", as far as other programs need it.
struct Extrinsics {
  Setup setup = Setup::eye_in_hand;
  std::string method;
  NamedTransform transform;                ///< gripper <- camera (eye-in-hand) or base <- camera
  NamedTransform target_pose;              ///< base <- target (eye-in-hand) or gripper <- target
  Matrix6d covariance = Matrix6d::Zero();  ///< of the transform, right perturbation (dt, dtheta) [m, rad]
  double target_scale =
      1;  ///< size of the target that transform and target_pose are for, over the stated one
  double corner_px = 0, robot_rotation_rad = 0, robot_translation_m = 0;  ///< estimated noise per axis
  bool pixels = true;                 ///< false: of pose pairs, which have no corners
  std::vector<std::string> warnings;  ///< of the calibration, worst first
  bool usable = true;                 ///< false: it ended with exit code 3
  ExtrinsicsInputs inputs;
};

const char* to_string(Setup setup);  ///< "eye-in-hand", "eye-to-hand"
/// Throws data::InputError naming `source` and `field`.
Setup parse_setup(const std::string& text, const std::string& source, const std::string& field);

Extrinsics extrinsics_of(const Calibration& calibration, const ExtrinsicsInputs& inputs);

/// Everything that formats.md asks for: transform, covariance, noise, residuals, comparison, views,
/// observability, findings, scale, warnings, provenance.
nlohmann::ordered_json to_json(const Calibration& calibration, const ExtrinsicsInputs& inputs, int exit_code);

/// Throws data::InputError naming file, field, what was found and what was expected; also where the
/// calibration ended with exit code 3, unless `accept_unusable`, which is what --force says.
Extrinsics load_extrinsics(const std::string& path, bool accept_unusable = false);

/// {"parent", "child", "translation": [x, y, z], "rotation_xyzw": [...]}
nlohmann::ordered_json to_json(const NamedTransform& transform);

/// `ros2 run tf2_ros static_transform_publisher --x ... --frame-id parent --child-frame-id child`
std::string ros_static_transform(const NamedTransform& transform);
/// A fixed joint, roll, pitch and yaw about fixed x, y, z.
std::string urdf_joint(const NamedTransform& transform);
/// easy_handeye2's calibration file.
std::string easy_handeye2(const NamedTransform& transform, Setup setup);

}  // namespace flash::calib
