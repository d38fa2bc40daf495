#pragma once
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "data/camera.h"
#include "data/trajectory.h"
#include "sysid/segment.h"

namespace flash::sysid {

/// The raw frames of one camera, in order of their file names.
struct RawView {
  std::string folder;
  std::vector<std::string> files;                ///< 16-bit depth PNG, or clouds (.ply, .pcd)
  std::optional<data::CameraIntrinsics> camera;  ///< of depth images; clouds need none
  Eigen::Isometry3d base_from_camera = Eigen::Isometry3d::Identity();  ///< T_base_camera
  double depth_scale = 0.001;                                          ///< [m] a count
  std::vector<std::string> warnings;                                   ///< of the calibration of the camera
};

/// Finds what a folder holds: clouds in it (or in clouds/, frames/), else depth images in depth/ (or in it)
/// with camera_info.yaml beside them. T_base_camera comes from `extrinsics.json` ("flash-extrinsics/1");
/// clouds without one are taken as they stand, in the base frame. Throws InputError naming what is missing.
/// `accept_unusable`: extrinsics that flash-calib ended with exit code 3, refused otherwise.
RawView open_raw_view(const std::string& folder, bool accept_unusable = false);

/// One frame in the base frame [m]; depth pixels of zero are left out.
data::Points load_raw_frame(const RawView& view, int frame);

struct SegmentedFolder {
  std::optional<TablePlane> table;   ///< as found over all frames
  std::vector<Segmentation> frames;  ///< without labels
  std::vector<std::string> clouds;   ///< files written, one a frame, relative to the folder
  std::string picture;               ///< file written, relative to the folder
};

struct SegmentFolderSettings {
  SegmentSettings segment;
  bool find_table = true;                   ///< false: nothing is cut below the cloth
  std::optional<data::Trajectory> gripper;  ///< T_base_gripper: with it the arm above the gripper is cut away
  double arm_radius = 0.06;                 ///< of what is cut away [m]
  int picture_frames = 6;                   ///< shown, evenly spread over the recording
};

/// Cuts the cloth out of every frame, all views of one index merged, and writes `folder`/frames/NNNNNN.ply
/// and segment.png: each column a frame, from the side above, from the top below; cloth red, table grey, arm
/// blue, other clusters ochre, outliers violet. `times`: one a frame [s]. Throws InputError where views
/// differ in their number of frames, no table is found, or no frame holds any cloth.
SegmentedFolder segment_folder(const std::vector<RawView>& views, const std::vector<double>& times,
                               const SegmentFolderSettings& settings, const std::string& folder);

}  // namespace flash::sysid
