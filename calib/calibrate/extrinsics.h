#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "calib/calibrate/calibrate.h"
#include "calib/dataset/depth_use.h"
#include "calib/solve/time_offset.h"
#include "data/camera/extrinsics.h"

namespace flash::calib {

using data::NamedTransform;

/// What a calibration was made from, so that it can be made again, and what took part beside the corners.
struct ExtrinsicsInputs {
  std::string dataset, target, poses, camera, refiner;
  std::optional<DepthUse> depth = {};
  std::optional<TimeOffset> time_offset = {};
  std::string robot = {}, base_link = {}, tip_link = {};  ///< URDF whose joints the poses are, as load_urdf
  double link_length_sd = 0;                              ///< as in DatasetOptions [m]
  std::optional<ArmModel> arm = {};                       ///< what that URDF says; not read from a file
};

/// The same with paths as a reader of the file `out` needs them: relative to its folder, so that file and
/// dataset can be moved together. Nothing changes where `out` is empty.
ExtrinsicsInputs relative_to(ExtrinsicsInputs inputs, const std::string& out);

/// A path of the provenance: from the folder of the calibration, else from the current one. Throws
/// data::InputError where it is at neither.
std::string resolved(const std::string& path, const std::string& calibration);

/// Standard deviations of a transform along and about the axes of its parent, in which its translation is
/// written. covariance: of the right perturbation (dt, dtheta), along those of the child.
Vector6d parent_deviations(const Eigen::Isometry3d& T, const Matrix6d& covariance);

/// The standard deviations of a calibration's transform along and about the axes of its parent, or of the
/// camera, as `covariance` has them. None along an axis that leans by more than 1 % to one along which
/// nothing is told.
using ToldDeviations = std::array<std::optional<double>, 6>;
enum class Axes { parent, camera };
ToldDeviations told_deviations(const Calibration& calibration, Matrix6d covariance, Axes axes);

/// What flash-calib handeye wrote, as far as other programs need it.
struct Extrinsics {
  Setup setup = Setup::eye_in_hand;
  std::string method;
  NamedTransform transform;                    ///< gripper <- camera (eye-in-hand) or base <- camera
  NamedTransform target_pose;                  ///< base <- target (eye-in-hand) or gripper <- target
  Matrix6d covariance = Matrix6d::Zero();      ///< of the transform, right perturbation (dt, dtheta) [m, rad]
  TargetShape target;                          ///< that transform and target_pose are for
  double focal_length = 1;                     ///< of pose pairs, over that with which they were made
  bool size_unknown = false;                   ///< nothing was known of the target's size beforehand
  double edge_offset = 0;                      ///< of the camera's pictures [px], see EdgeOffset
  std::optional<data::CameraIntrinsics> lens;  ///< likewise; none of pose pairs
  std::optional<data::CameraIntrinsics> stated_lens;  ///< that the calibration began with, where it is known
  double corner_px = 0, robot_rotation_rad = 0, robot_translation_m = 0;  ///< estimated noise per axis
  std::optional<ClosingError>
      held_out;        ///< rms of the target's pose in views left out; none in files without
  bool pixels = true;  ///< false: of pose pairs, which have no corners
  Use use = Use::workspace;
  std::vector<std::string> warnings;       ///< of the calibration, worst first
  bool usable = true;                      ///< false: it ended with exit code 3
  std::vector<JointOrigin> joint_origins;  ///< of the arm that the transform holds with; none of poses
  ExtrinsicsInputs inputs;
};

Extrinsics extrinsics_of(const Calibration& calibration, const ExtrinsicsInputs& inputs);

/// Throws data::InputError naming file, field, what was found and what was expected; also where the
/// calibration ended with exit code 3, unless `accept_unusable`, which is what --despite-doubts says.
Extrinsics load_extrinsics(const std::string& path, bool accept_unusable = false);

}  // namespace flash::calib
