#include "sysid/segment_folder.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "data/depth_image.h"
#include "data/error.h"
#include "data/extrinsics.h"
#include "data/mesh_io.h"
#include "data/text.h"
#include "sysid/segment_picture.h"

namespace flash::sysid {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> files_with(const fs::path& folder, const std::vector<std::string>& extensions) {
  std::vector<std::string> files;
  if (!fs::is_directory(folder)) return files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (std::count(extensions.begin(), extensions.end(), data::lower_extension(entry.path().string())))
      files.push_back(entry.path().string());
  std::sort(files.begin(), files.end());
  return files;
}

// The first of the folders that holds such files.
std::vector<std::string> first_with(const fs::path& folder, const std::vector<std::string>& subfolders,
                                    const std::vector<std::string>& extensions) {
  for (const std::string& subfolder : subfolders) {
    std::vector<std::string> files = files_with(folder / subfolder, extensions);
    if (!files.empty()) return files;
  }
  return {};
}

data::Points merged(const std::vector<RawView>& views, int frame) {
  std::vector<data::Points> parts;
  Eigen::Index count = 0;
  for (const RawView& view : views) {
    parts.push_back(load_raw_frame(view, frame));
    count += parts.back().rows();
  }
  data::Points points(count, 3);
  Eigen::Index row = 0;
  for (const data::Points& part : parts) {
    points.middleRows(row, part.rows()) = part;
    row += part.rows();
  }
  return points;
}

// The table does not move: one plane from a few frames, thinned alike, serves all.
TablePlane table_of(const std::vector<RawView>& views, int frames, const SegmentSettings& settings) {
  constexpr int wanted_frames = 5, wanted_points = 20000;
  const int used = std::min(frames, wanted_frames);
  std::vector<Eigen::RowVector3d> rows;
  for (int k = 0; k < used; ++k) {
    const data::Points points = merged(views, k * frames / used);
    const Eigen::Index stride = std::max<Eigen::Index>(1, points.rows() / wanted_points);
    for (Eigen::Index i = 0; i < points.rows(); i += stride) rows.push_back(points.row(i));
  }
  data::Points sample(rows.size(), 3);
  for (std::size_t i = 0; i < rows.size(); ++i) sample.row(i) = rows[i];
  return find_table(sample, settings);
}

std::string frame_name(int frame) {
  char name[32];
  std::snprintf(name, sizeof name, "frames/%06d.ply", frame);
  return name;
}

}  // namespace

RawView open_raw_view(const std::string& folder, bool accept_unusable) {
  if (!fs::is_directory(folder)) throw data::input_error(folder, "folder", "does not exist");
  RawView view;
  view.folder = folder;
  view.files = first_with(folder, {"", "clouds", "frames"}, {".ply", ".pcd"});
  const bool clouds = !view.files.empty();
  if (!clouds) {
    view.files = first_with(folder, {"depth", ""}, {".png"});
    if (view.files.empty())
      throw data::input_error(folder, "folder",
                              "found neither clouds (.ply, .pcd) nor 16-bit depth images (.png)");
    view.camera = data::load_camera_intrinsics((fs::path(folder) / "camera_info.yaml").string());
  }
  const fs::path extrinsics = fs::path(folder) / "extrinsics.json";
  if (fs::exists(extrinsics)) {
    const data::CameraPose pose = data::load_camera_pose(extrinsics.string(), accept_unusable);
    view.base_from_camera = pose.transform.T;
    for (const std::string& warning : pose.warnings)
      view.warnings.push_back(extrinsics.string() + ": " + warning);
  } else if (!clouds) {
    throw data::input_error(extrinsics.string(), "file",
                            "missing: depth images need the pose of their camera");
  }
  return view;
}

data::Points load_raw_frame(const RawView& view, int frame) {
  const std::string& file = view.files[frame];
  data::Points points = view.camera ? data::points_from_depth(data::load_depth_image(file), {}, *view.camera,
                                                              view.depth_scale, file)
                                    : data::load_point_cloud(file);
  points *= view.base_from_camera.linear().transpose();
  points.rowwise() += view.base_from_camera.translation().transpose();
  return points;
}

SegmentedFolder segment_folder(const std::vector<RawView>& views, const std::vector<double>& times,
                               const SegmentFolderSettings& settings, const std::string& folder) {
  const int frames = static_cast<int>(times.size());
  for (const RawView& view : views)
    if (static_cast<int>(view.files.size()) != frames)
      throw data::input_error(view.folder, "frames",
                              "found " + std::to_string(view.files.size()) + ", expected " +
                                  std::to_string(frames) + ": one a time stamp, the same in every view");
  SegmentedFolder result;
  if (settings.find_table) result.table = table_of(views, frames, settings.segment);

  std::vector<LabelledFrame> shown;
  int with_cloth = 0;
  for (int k = 0; k < frames; ++k) {
    LabelledFrame frame{merged(views, k), {}};
    ArmCylinder arm;
    arm.radius = settings.gripper ? settings.arm_radius : 0;
    if (settings.gripper) arm.tip = data::pose_at(*settings.gripper, times[k]).translation();
    Segmentation segmentation = segment_cloth(frame.points, result.table, arm, settings.segment);
    with_cloth += segmentation.cloth.rows() > 0;
    result.clouds.push_back(frame_name(k));
    data::save_point_cloud(segmentation.cloth, (fs::path(folder) / result.clouds.back()).string());
    const int columns = std::min(frames, settings.picture_frames);
    const int next = static_cast<int>(shown.size());
    if (next < columns && k == (columns == 1 ? 0 : next * (frames - 1) / (columns - 1))) {
      frame.labels = segmentation.labels;
      shown.push_back(std::move(frame));
    }
    segmentation.labels.clear();
    result.frames.push_back(std::move(segmentation));
  }
  if (with_cloth == 0)
    throw data::input_error(views.front().folder, "frames",
                            "no frame holds a cluster of " + std::to_string(settings.segment.cluster_points) +
                                " points above the table");
  result.picture = "segment.png";
  data::save_png(draw_segmentation(shown), (fs::path(folder) / result.picture).string());
  return result;
}

}  // namespace flash::sysid
