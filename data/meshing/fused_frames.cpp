#include "data/meshing/fused_frames.h"

#include "data/camera/camera.h"
#include "data/camera/depth_map.h"
#include "data/camera/extrinsics.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "data/mesh/mesh_io.h"
#include "data/motion/trajectory.h"
#include "data/recording/frame_files.h"

namespace flash::data {
namespace {

constexpr std::size_t most_points = 20'000'000;

/// Adds points to those that there are.
void append(std::vector<double>& coordinates, const Points& points, const std::string& source) {
  coordinates.insert(coordinates.end(), points.data(), points.data() + points.size());
  if (coordinates.size() > 3 * most_points)
    throw InputError(source + ": with it there are " + format_count(coordinates.size() / 3) +
                     " points, expected at most " + format_count(most_points) + "; take fewer frames");
}

Points points_of(const std::vector<double>& coordinates) {
  return Eigen::Map<const Points>(coordinates.data(), Eigen::Index(coordinates.size() / 3), 3);
}

}  // namespace

Points fused_depth(const DepthFrames& frames, bool accept_unusable, std::string& notice) {
  const std::vector<std::string> files = files_in_order(frames.folder, depth_endings());
  if (files.empty()) throw InputError(frames.folder + ": found no depth images (.png, .npy, .tiff)");
  std::optional<LensOfFile> own;
  if (!frames.intrinsics.empty())
    own = {load_depth_lens(frames.intrinsics, files.front()), frames.intrinsics};
  CameraPose still;
  std::vector<Eigen::Isometry3d> poses;
  if (frames.poses.empty()) {
    still = load_camera_pose(frames.extrinsics, accept_unusable);
    poses.assign(files.size(), still.transform.T);
  } else {
    poses = load_trajectory(frames.poses).poses;
  }
  const auto [camera, said] = posed_lens(still, frames.extrinsics, own, frames.lens);
  notice = said;
  if (poses.size() != files.size())
    throw InputError(frames.poses + ": found " + format_count(poses.size()) + " poses, expected " +
                     format_count(files.size()) + ", one a frame of " + frames.folder);
  std::vector<double> coordinates;
  for (std::size_t i = 0; i < files.size(); ++i) {
    MaskImage mask;
    if (!frames.masks.empty()) mask = load_mask(mask_of(frames.masks, files[i]));
    const Points seen = points_from_depth(load_depth(files[i], frames.depth_scale), mask, camera, files[i]);
    append(coordinates, (seen * poses[i].linear().transpose()).rowwise() + poses[i].translation().transpose(),
           files[i]);
  }
  return points_of(coordinates);
}

Points fused_clouds(const std::string& folder, std::size_t& left_out) {
  const std::vector<std::string> files = files_in_order(folder, {".ply", ".pcd"});
  if (files.empty()) throw InputError(folder + ": found no .ply and no .pcd");
  std::vector<double> coordinates;
  for (const std::string& file : files) append(coordinates, load_point_cloud(file, left_out), file);
  return points_of(coordinates);
}

}  // namespace flash::data
