#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "data/camera/posed_lens.h"
#include "data/mesh/mesh.h"

namespace flash::data {

/// Frames of depth of one thing that does not move, and where each was seen from.
struct DepthFrames {
  std::string folder;      ///< as load_depth reads them, in order of name
  std::string masks;       ///< folder of masks of the same names; may be empty
  std::string intrinsics;  ///< as load_intrinsics reads it; may be empty where extrinsics hold a lens
  LensChoice lens = LensChoice::agreeing;
  std::string poses;       ///< T_world_camera, a pose a frame: TUM or CSV; or, of a camera that stands still,
  std::string extrinsics;  ///< as load_camera_pose reads it
  double depth_scale = 0.001;  ///< [m] a count
};

/// What all frames saw, in one frame [m]. Throws InputError that names the file: of no frames, of another
/// number of poses than frames, of a lens that is not that of its extrinsics (posed_lens.h), and above 20
/// million points. `notice` becomes what people should know of the lens.
Points fused_depth(const DepthFrames& frames, bool accept_unusable, std::string& notice);

/// The clouds of a folder (.ply, .pcd), all in one frame; `left_out` grows by points that are not finite.
Points fused_clouds(const std::string& folder, std::size_t& left_out);

}  // namespace flash::data
