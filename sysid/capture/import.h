#pragma once
#include <array>
#include <atomic>
#include <optional>
#include <string>
#include <vector>

#include "data/camera/posed_lens.h"
#include "data/mesh/mesh.h"
#include "data/motion/trajectory.h"
#include "data/recording/recording.h"

namespace flash::sysid {

/// What observations need to become a recording.
struct ImportSettings {
  static constexpr double frames_per_second = 10;  ///< where nothing else is said

  std::vector<std::string> clouds;  ///< .ply or .pcd in the base frame, in order of time; or
  std::vector<std::string> depth;   ///< 16-bit .png in the camera frame, in order of time, with
  std::string masks;                ///< a folder of masks of the same names, may be empty
  std::string intrinsics;           ///< camera_info or OpenCV YAML; may be empty where extrinsics hold a lens
  data::LensChoice lens = data::LensChoice::agreeing;
  std::string extrinsics;      ///< T_base_camera: extrinsics JSON, or a TUM file whose first pose counts
  double depth_scale = 0.001;  ///< [m] a count

  std::vector<double> times;    ///< one a frame, increasing [s]; empty: frames_per_second, and a notice
  data::Trajectory trajectory;  ///< T_base_gripper, two poses or more
  std::string trajectory_path;  ///< where it stands, for messages
  std::string mesh_spec;        ///< mesh spec or file that `mesh` came from
  data::TriangleMesh mesh;      ///< the sheet at rest, in the plane z = 0 [m]
  data::Selection grasp{std::array<int, 2>{0, 0}, {}, {}, 0.012};  ///< by the one gripper
  data::GraspShape shape = data::GraspShape::clamp;
  bool tool_at_patch =
      false;  ///< the middle of the grasped patch is at the tool centre point, not the corner
  data::CropBox crop;
  std::optional<double>
      table_height;  ///< [m]; empty: the lower of the gripper's start and the crop's lower end
  /// Heading of the sheet's diagonal from the grasped corner, about z from x [rad]; empty: towards the
  /// clouds.
  std::optional<double> heading;
  data::NuisanceBounds nuisance;
  Eigen::Vector3d gravity{0, 0, -9.81};  ///< [m/s^2]
  std::string asset;                     ///< file, may be empty
  std::string kind = "corner_lift";
  std::string name;  ///< empty: the folder's
  std::string out;   ///< folder to make
  bool overwrite = false;
  bool accept_unusable = false;  ///< extrinsics that flash-calib ended with exit code 3, and contradictions
  std::vector<Eigen::Vector3d> cameras;     ///< that made the clouds, base frame [m]; for the picture
  std::vector<std::string> taken;           ///< what came from elsewhere than its option, for people to read
  const std::atomic<bool>* stop = nullptr;  ///< once set, it ends before its next frame
};

/// Writes out/recording.json with its frames, trajectory and camera copied beside it, and a picture of what a
/// search will start from, import.svg, and loads it back to check it. The start pose is a guess: flat on the
/// table, the grasped corner under the gripper, the diagonal along `heading`; notices say what was guessed,
/// and where first clouds, of a sheet that still lies, fit it better with its sides changed over. Throws
/// InputError, and leaves nothing behind, where the check fails and where inputs contradict each other
/// (import_checks.h) and are not accepted so; likewise data::Stopped once settings.stop is set.
data::Recording import_recording(const ImportSettings& settings);

}  // namespace flash::sysid
