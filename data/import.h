#pragma once
#include <optional>
#include <string>
#include <vector>

#include "data/recording.h"

namespace flash::data {

/// What a folder of observations needs to become a recording. Texts are as on the command line.
struct ImportOptions {
  std::string clouds;      ///< folder of .ply or .pcd in the base frame, by name, 2 before 10; or
  std::string depth;       ///< folder of 16-bit .png in the camera frame, with
  std::string masks;       ///< a folder of masks of the same names, may be empty
  std::string intrinsics;  ///< camera_info or OpenCV YAML
  std::string
      extrinsics;  ///< T_base_camera: "flash-extrinsics/1" JSON, or a TUM file whose first pose counts
  double depth_scale = 0.001;  ///< [m] a count

  std::string trajectory;  ///< T_base_gripper, TUM or CSV
  std::string times;       ///< "rate:HZ", "rate:HZ:START", or a CSV with a column t or t_s, one line a frame;
                           ///< empty: 10 a second, and a notice
  std::string sheet;       ///< "WIDTHxHEIGHT" [m]; or
  std::string mesh;        ///< mesh spec or file
  double cell = 0.01;      ///< of the sheet [m]
  std::string grasp =
      "corner";  ///< "corner", "corner:I,J", "vertices:A,B,..." or "position": what is near the gripper
  std::optional<double> within;  ///< [m]; empty: 1.2 cells
  bool tool_at_patch =
      false;  ///< the middle of the grasped patch is at the tool centre point, not the corner
  GraspShape shape = GraspShape::clamp;
  std::string crop_x, crop_y, crop_z;  ///< "LOW:HIGH" [m], either side may be empty
  std::optional<double>
      table_height;  ///< [m]; empty: the lower of the gripper's start and the crop's lower end
  /// Heading of the sheet's diagonal from the grasped corner, about z from x [rad]; empty: towards the
  /// clouds.
  std::optional<double> heading;
  NuisanceBounds nuisance;
  Eigen::Vector3d gravity{0, 0, -9.81};  ///< [m/s^2]
  std::string asset;                     ///< file, may be empty
  std::string kind = "corner_lift";
  std::string name;  ///< empty: the folder's
  std::string out;   ///< folder to make
  bool overwrite = false;
  bool accept_unusable = false;  ///< extrinsics that flash-calib ended with exit code 3
};

/// Writes out/recording.json with its frames, trajectory and camera copied beside it, and loads it back to
/// check it. The start pose is a guess: flat on the table, the grasped corner under the gripper, the diagonal
/// along `heading`; notices say what was guessed, and where first clouds, of a sheet that still lies, fit it
/// better with its sides changed over. Throws InputError, and leaves nothing behind, where the check fails.
Recording import_recording(const ImportOptions& options);

}  // namespace flash::data
