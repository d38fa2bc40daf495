#pragma once
#include <Eigen/Geometry>
#include <atomic>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "data/camera/camera.h"
#include "data/camera/posed_lens.h"
#include "data/motion/trajectory.h"
#include "sysid/capture/segment/segment.h"

namespace flash::sysid {

/// The raw frames of one camera, in order of their file names, 2 before 10.
struct RawView {
  std::string folder;
  std::vector<std::string> files;                ///< 16-bit depth PNG, or clouds (.ply, .pcd)
  std::vector<std::string> masks;                ///< of depth images: one a file, or none
  std::optional<data::CameraIntrinsics> camera;  ///< of depth images; clouds need none
  Eigen::Isometry3d base_from_camera = Eigen::Isometry3d::Identity();  ///< T_base_camera
  double depth_scale = 0.001;                                          ///< [m] a count
  std::vector<std::string> warnings;  ///< of the calibration of the camera and of its lens
};

/// What is not found in a view's folder, or counts in its place; empty where not given. As for `import`.
struct RawViewFiles {
  std::string masks;       ///< folder of masks with the names of the depth images
  std::string intrinsics;  ///< camera_info or OpenCV YAML
  std::string extrinsics;  ///< T_base_camera: extrinsics JSON, or a TUM file whose first pose counts
  data::LensChoice lens = data::LensChoice::agreeing;
  std::optional<double> depth_scale;  ///< [m] a count
  bool accept_unusable = false;       ///< extrinsics that flash-calib ended with exit code 3
};

/// Finds what a folder holds: clouds in it (or in clouds/, frames/), else depth images in depth/ (or in it)
/// with camera_info.yaml beside them. T_base_camera comes from `extrinsics.json` or `extrinsics.tum`, and
/// with it the lens that it holds with (posed_lens.h); clouds without one are taken as they stand, in the
/// base frame. Throws InputError naming what is missing, or the two lenses.
RawView open_raw_view(const std::string& folder, const RawViewFiles& given = {});

/// One frame in the base frame [m]; depth pixels of zero, what is masked and points that are not finite are
/// left out, the last counted in `not_finite`.
data::Points load_raw_frame(const RawView& view, int frame, bool masked, std::size_t& not_finite);

struct SegmentedFolder {
  std::optional<FoundTable> table;    ///< as found over all frames, or given: of no frames
  std::vector<Segmentation> frames;   ///< without labels
  std::vector<std::string> clouds;    ///< files written, one a frame, relative to the folder
  std::string picture;                ///< file written, relative to the folder
  std::vector<std::string> warnings;  ///< what to look at before the clouds are used
};

struct SegmentFolderSettings {
  SegmentSettings segment;
  bool find_table = true;                   ///< false: nothing is cut below the cloth, but by table_height
  std::optional<double> table_height;       ///< of a level table that is known: none is sought [m]
  std::optional<data::Trajectory> gripper;  ///< T_base_gripper: with it the arm above the gripper is cut away
  std::string gripper_path = "trajectory";  ///< its name in messages
  double arm_radius = 0.06;                 ///< of what is cut away [m]
  int picture_frames = 6;                   ///< shown, evenly spread over the recording
  bool accept_fault = false;                ///< of the cell: say it, and go on
  std::function<void(const std::string&)> told;  ///< progress, for people to read; may be empty
  const std::atomic<bool>* stop = nullptr;       ///< once set, it ends before its next frame
};

/// Cuts the cloth out of every frame, all views of one index merged, and writes `folder`/frames/NNNNNN.ply,
/// what it knows of the cell (segmented_cell.h), and segment.svg: each column a frame, from the side above,
/// from the top below; cloth red, table grey, arm blue, other clusters ochre, outliers violet. `times`: one a
/// frame [s]; they count where there is a gripper, and may be empty without one. The table is sought in what
/// masks hide as well. Throws InputError, and leaves nothing behind, where views differ in their number of
/// frames, the gripper's clock is another one, no table is found, cameras, table and gripper are not of one
/// cell (cell_check.h), or no frame holds any cloth; likewise data::Stopped once settings.stop is set.
SegmentedFolder segment_folder(const std::vector<RawView>& views, const std::vector<double>& times,
                               const SegmentFolderSettings& settings, const std::string& folder);

}  // namespace flash::sysid
