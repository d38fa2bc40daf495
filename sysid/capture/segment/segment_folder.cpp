#include "sysid/capture/segment/segment_folder.h"

#include <pcl/console/print.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "data/camera/depth_map.h"
#include "data/camera/extrinsics.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/staged_folder.h"
#include "data/files/stop.h"
#include "data/files/text.h"
#include "data/mesh/mesh_io.h"
#include "data/recording/bag_file.h"
#include "data/recording/frame_files.h"
#include "sysid/capture/clocks.h"
#include "sysid/capture/segment/cell_check.h"
#include "sysid/capture/segment/segment_picture.h"
#include "sysid/capture/segmented_cell.h"

namespace flash::sysid {
namespace {

namespace fs = std::filesystem;

// The first of the folders that holds such files.
std::vector<std::string> first_with(const fs::path& folder, const std::vector<std::string>& subfolders,
                                    const std::vector<std::string>& extensions) {
  for (const std::string& subfolder : subfolders) {
    if (!fs::is_directory(folder / subfolder)) continue;
    std::vector<std::string> files = data::files_in_order((folder / subfolder).string(), extensions);
    if (!files.empty()) return files;
  }
  return {};
}

data::Points merged(const std::vector<RawView>& views, int frame, bool masked, std::size_t& not_finite) {
  std::vector<data::Points> parts;
  Eigen::Index count = 0;
  for (const RawView& view : views) {
    parts.push_back(load_raw_frame(view, frame, masked, not_finite));
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

// Some frames, evenly over the recording, thinned.
std::vector<CellFrame> sampled_frames(const std::vector<RawView>& views, const std::vector<double>& times,
                                      const std::optional<data::Trajectory>& gripper) {
  constexpr int wanted_frames = 12, wanted_points = 10000;
  const int frames = static_cast<int>(views.front().files.size());
  const int used = std::min(frames, wanted_frames);
  std::vector<CellFrame> sample;
  std::size_t not_finite = 0;
  for (int k = 0; k < used; ++k) {
    const int frame = k * frames / used;
    const data::Points points = merged(views, frame, false, not_finite);
    const Eigen::Index step = 1 + points.rows() / wanted_points;
    sample.push_back({points(Eigen::seq(0, Eigen::last, step), Eigen::all), {}});
    if (gripper) sample.back().tool = data::pose_at(*gripper, times[frame]).translation();
  }
  return sample;
}

// The table does not move: one plane serves all frames.
FoundTable table_of(const std::vector<CellFrame>& frames, const SegmentSettings& settings) {
  std::vector<data::Points> sample;
  for (const CellFrame& frame : frames) sample.push_back(frame.points);
  return find_table(sample, settings);
}

std::optional<FoundTable> table_as_asked(const std::vector<CellFrame>& frames,
                                         const SegmentFolderSettings& settings) {
  if (settings.table_height)
    return FoundTable{{{0, 0, *settings.table_height}, settings.segment.up}, 0, 0, 0};
  return settings.find_table ? std::optional(table_of(frames, settings.segment)) : std::nullopt;
}

std::vector<Eigen::Vector3d> places_of(const std::vector<RawView>& views) {
  std::vector<Eigen::Vector3d> places;
  for (const RawView& view : views)
    if (view.camera) places.emplace_back(view.base_from_camera.translation());
  return places;
}

std::string fault_of(const std::vector<RawView>& views, const std::vector<CellFrame>& frames,
                     const std::optional<FoundTable>& table, const SegmentSettings& settings) {
  return cell_fault(frames, table ? std::optional(table->plane) : std::nullopt, places_of(views), settings);
}

/// The poses that a cell is made of.
struct CellPoses {
  std::vector<RawView> views;
  std::optional<data::Trajectory> gripper;
};

template <typename Change>
void change_cameras(CellPoses& poses, const Change& change) {
  for (RawView& view : poses.views)
    if (view.camera) view.base_from_camera = change(view.base_from_camera);
}

struct PoseMistake {
  std::string said;  ///< of what was given, for people to read
  std::function<void(CellPoses&)> mend;
};

std::vector<PoseMistake> usual_poses() {
  using Pose = Eigen::Isometry3d;
  const Pose opengl(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
  return {{"the camera's axes are those of OpenGL (y up, z backwards), where x right, y down, z forwards is "
           "expected",
           [opengl](CellPoses& poses) {
             change_cameras(poses, [&](const Pose& pose) { return Pose(pose * opengl); });
           }},
          {"the pose is that of the base in the camera, where that of the camera in the base is expected",
           [](CellPoses& poses) { change_cameras(poses, [](const Pose& pose) { return pose.inverse(); }); }},
          {"the pose is that of the base in a camera with axes of OpenGL",
           [opengl](CellPoses& poses) {
             change_cameras(poses, [&](const Pose& pose) { return (opengl * pose).inverse(); });
           }},
          {"the quaternion of the camera is w x y z, where x y z w is expected",
           [](CellPoses& poses) {
             change_cameras(poses, [](Pose pose) {
               const Eigen::Quaterniond read(pose.linear());
               pose.linear() = Eigen::Quaterniond(read.x(), read.y(), read.z(), read.w()).toRotationMatrix();
               return pose;
             });
           }},
          {"the camera's position is in millimetres, where metres are expected",
           [](CellPoses& poses) {
             change_cameras(poses, [](Pose pose) {
               pose.translation() *= 1e-3;
               return pose;
             });
           }},
          {"the gripper's positions are in millimetres, where metres are expected", [](CellPoses& poses) {
             if (!poses.gripper) return;
             for (Pose& pose : poses.gripper->poses) pose.translation() *= 1e-3;
           }}};
}

// Of depth images whose counts are no metres by themselves.
std::vector<PoseMistake> usual_scales(const std::vector<RawView>& views) {
  std::vector<PoseMistake> mistakes;
  for (const double scale : {1e-3, 1e-4, 2.5e-4, 2e-4, 1e-2, 1.0}) {
    const auto is_other = [scale](const RawView& view) {
      return view.camera && data::lower_extension(view.files.front()) == ".png" &&
             std::abs(view.depth_scale - scale) > 1e-6 * scale;
    };
    if (std::any_of(views.begin(), views.end(), is_other))
      mistakes.push_back(
          {"a count of the depth images is " + data::format_short(scale) + " m (--depth-scale " +
               data::format_short(scale) + "), where " +
               data::format_short(std::find_if(views.begin(), views.end(), is_other)->depth_scale) +
               " m is taken",
           [is_other, scale](CellPoses& poses) {
             for (RawView& view : poses.views)
               if (is_other(view)) view.depth_scale = scale;
           }});
  }
  return mistakes;
}

double lowest_over(const TablePlane& table, const std::vector<CellFrame>& frames) {
  double lowest = INFINITY;
  for (const CellFrame& frame : frames)
    if (frame.tool) lowest = std::min(lowest, (*frame.tool - table.point).dot(table.normal));
  return lowest;
}

constexpr double known_height = 0.03;  // of a table that is stated and one that is seen [m]
constexpr double level = 0.1;          // tables are, as a camera sees them [rad]

// The table that is seen, if it is level, and where it is stated at that height.
std::optional<FoundTable> seen_table(const std::vector<CellFrame>& frames,
                                     const SegmentFolderSettings& settings) {
  try {
    FoundTable table = table_of(frames, settings.segment);
    const Eigen::Vector3d stated(0, 0, settings.table_height.value_or(0));
    const double off = settings.table_height ? (stated - table.plane.point).dot(settings.segment.up) : 0;
    if (table.tilt < level && std::abs(off) < known_height) return table;
  } catch (const data::InputError&) {  // no table there
  }
  return std::nullopt;
}

// Which usual mistake would make a cell of what is given, for people to read; may be empty. One with which a
// level table is seen counts first, and there the one whose gripper comes closest to it, as it lifts from it.
// `seen`: only such ones count.
std::string suspected_mistake(const std::vector<RawView>& views, const std::vector<double>& times,
                              const SegmentFolderSettings& settings, bool seen) {
  std::vector<PoseMistake> mistakes = usual_poses();
  for (PoseMistake& mistake : usual_scales(views)) mistakes.push_back(std::move(mistake));
  std::string with_table, without_table;
  double least = INFINITY;
  for (const PoseMistake& mistake : mistakes) {
    CellPoses other{views, settings.gripper};
    mistake.mend(other);
    try {
      const std::vector<CellFrame> frames = sampled_frames(other.views, times, other.gripper);
      if (const std::optional<FoundTable> table = seen_table(frames, settings)) {
        if (!fault_of(other.views, frames, table, settings.segment).empty()) continue;
        const double height = settings.gripper ? std::abs(lowest_over(table->plane, frames)) : table->tilt;
        if (height < least) least = height, with_table = mistake.said;
      } else if (!seen && without_table.empty()) {
        if (fault_of(other.views, frames, table_as_asked(frames, settings), settings.segment).empty())
          without_table = mistake.said;
      }
    } catch (const data::InputError&) {  // no table there, or points that are nowhere
    }
  }
  const std::string& said = with_table.empty() ? without_table : with_table;
  return said.empty() ? "" : ". It would be one if " + said;
}

void check_cell(const std::vector<RawView>& views, const std::vector<double>& times,
                const std::vector<CellFrame>& frames, const SegmentFolderSettings& settings,
                SegmentedFolder& result) {
  std::string fault = fault_of(views, frames, result.table, settings.segment), mistake;
  if (!fault.empty()) {
    mistake = suspected_mistake(views, times, settings, false);
  } else if (settings.table_height && !seen_table(frames, settings)) {
    // A stated table hides that none is seen there; it may be out of view.
    mistake = suspected_mistake(views, times, settings, true);
    if (!mistake.empty())
      fault = "no plane is seen at --table-z " + data::format_short(*settings.table_height);
  }
  if (fault.empty()) return;
  const std::string text =
      views.front().folder + ": cameras, table and gripper are not of one cell: " + fault + mistake;
  if (!settings.accept_fault)
    throw data::InputError(text + ". Look at the camera's pose and at the frame and the tool of " +
                           (settings.gripper ? settings.gripper_path : "the trajectory") +
                           "; --despite-doubts takes them as they are");
  result.warnings.push_back(text);
}

/// Throws InputError where all frames are one while the gripper moves, unless the fault is accepted.
void expect_moving(const std::string& folder, const std::vector<CellFrame>& frames,
                   const SegmentFolderSettings& settings) {
  constexpr double kMoves = 0.02;  // [m]
  if (!settings.gripper || frames.size() < 2 || settings.accept_fault) return;
  double way = 0;
  for (const CellFrame& frame : frames) {
    const data::Points &first = frames.front().points, &points = frame.points;
    if (points.rows() != first.rows() || points != first) return;  // noise alone would tell two frames apart
    way = std::max(way, (*frame.tool - *frames.front().tool).norm());
  }
  if (way > kMoves)
    throw data::InputError(folder + ": its frames are all alike, while the gripper moves by " +
                           data::format_short(way) +
                           " m: was it one picture that was saved? --despite-doubts takes them as they are");
}

std::string tilt_warning(const FoundTable& table) {
  char text[400];
  const Eigen::Vector3d& n = table.plane.normal;
  std::snprintf(
      text, sizeof text,
      "table: the plane that was found is tilted by %.1f deg against z of the base frame (normal %.4f "
      "%.4f %.4f; seen in %d of %d frames): is the camera's pose right, and is this the table? "
      "--table-z gives one that is level",
      table.tilt * 180 / M_PI, n.x(), n.y(), n.z(), table.agreeing, table.frames);
  return text;
}

// A tool grasps cloth that lies, and its flange is some way above it; may be empty.
std::string flange_warning(const TablePlane& table, const std::vector<double>& times,
                           const SegmentFolderSettings& settings) {
  constexpr double kLowest = 0.06, kHighest = 0.4;  // of a flange over the table [m]
  if (!settings.gripper || times.empty()) return "";
  double lowest = INFINITY;
  for (const double time : times) {
    const Eigen::Vector3d tool = data::pose_at(*settings.gripper, time).translation();
    lowest = std::min(lowest, (tool - table.point).dot(table.normal));
  }
  if (lowest < kLowest || lowest > kHighest) return "";
  return settings.gripper_path + ": the gripper is never nearer to the table than " +
         data::format_short(std::round(1000 * lowest) / 1000) +
         " m: is it the flange, in place of the tool centre point? (or does the cloth hang from the start?)";
}

// Where all the points went instead.
std::string no_cloth(const std::vector<Segmentation>& frames, const SegmentFolderSettings& settings) {
  std::array<std::size_t, point_label_count> counts{};
  for (const Segmentation& frame : frames)
    for (int label = 0; label < point_label_count; ++label) counts[label] += frame.counts[label];
  std::string places;
  for (const PointLabel label :
       {PointLabel::outside, PointLabel::table, PointLabel::arm, PointLabel::clutter})
    places += (places.empty() ? "" : ", ") + data::format_count(counts[static_cast<int>(label)]) + ' ' +
              to_string(label);
  return "no frame holds a cluster of " + std::to_string(settings.segment.cluster_points) +
         " points above the table (points: " + places + ")";
}

std::string frame_name(int frame) {
  char name[32];
  std::snprintf(name, sizeof name, "frames/%06d.ply", frame);
  return name;
}

/// Of depth images, whose camera is at `pose`.
void take_lens(const data::CameraPose& pose, const std::string& pose_path, const RawViewFiles& given,
               RawView& view) {
  const std::string beside = (fs::path(view.folder) / "camera_info.yaml").string();
  const std::string path = given.intrinsics.empty() ? beside : given.intrinsics;
  std::optional<data::LensOfFile> own;
  if (!pose.lens || !given.intrinsics.empty() || fs::exists(beside))
    own = {data::load_depth_lens(path, view.files.front()), path};
  const data::PosedLens lens = data::posed_lens(pose, pose_path, own, given.lens);
  view.camera = lens.lens;
  if (!lens.notice.empty()) view.warnings.push_back(lens.notice);
}

}  // namespace

RawView open_raw_view(const std::string& folder, const RawViewFiles& given) {
  data::expect_no_bag(folder, "segment");
  if (!fs::is_directory(folder))
    throw data::input_error(folder, "folder",
                            fs::exists(folder) ? "is a file, expected a folder" : "does not exist");
  RawView view;
  view.folder = folder;
  view.files = first_with(folder, {"", "clouds", "frames"}, {".ply", ".pcd"});
  const bool clouds = !view.files.empty();
  if (clouds) {
    for (const auto& [option, path] : {std::pair("--masks", given.masks), {"--intrinsics", given.intrinsics}})
      if (!path.empty())
        throw data::InputError(folder + ": holds clouds, " + option + " is for depth images");
  } else {
    view.files = first_with(folder, {"depth", ""}, data::depth_endings());
    if (view.files.empty())
      throw data::input_error(
          folder, "folder", "found neither clouds (.ply, .pcd) nor depth images (16-bit .png, .npy, .tiff)");
    view.depth_scale = given.depth_scale.value_or(view.depth_scale);
  }
  if (!given.masks.empty())
    for (const std::string& file : view.files) view.masks.push_back(data::mask_of(given.masks, file));
  std::string extrinsics = given.extrinsics;
  for (const char* name : {"extrinsics.json", "extrinsics.tum"})
    if (const fs::path path = fs::path(folder) / name; extrinsics.empty() && fs::exists(path))
      extrinsics = path.string();
  if (!clouds && extrinsics.empty())
    throw data::input_error((fs::path(folder) / "extrinsics.json").string(), "file",
                            "missing: depth images need the pose of their camera, here or as --extrinsics");
  if (!extrinsics.empty()) {
    const data::CameraPose pose = data::load_camera_pose(extrinsics, given.accept_unusable);
    view.base_from_camera = pose.transform.T;
    for (const std::string& warning : pose.warnings) view.warnings.push_back(extrinsics + ": " + warning);
    if (!clouds) take_lens(pose, extrinsics, given, view);
  }
  return view;
}

data::Points load_raw_frame(const RawView& view, int frame, bool masked, std::size_t& not_finite) {
  constexpr double farthest = 1e5;  // no camera sees farther [m]
  const std::string& file = view.files[frame];
  data::Points points;
  if (view.camera) {
    const data::MaskImage mask =
        masked && !view.masks.empty() ? data::load_mask(view.masks[frame]) : data::MaskImage{};
    points = data::points_from_depth(data::load_depth(file, view.depth_scale), mask, *view.camera, file);
  } else {
    points = data::load_point_cloud(file, not_finite);
  }
  points *= view.base_from_camera.linear().transpose();
  points.rowwise() += view.base_from_camera.translation().transpose();
  if (points.rows() > 0 && !(points.cwiseAbs().maxCoeff() < farthest))
    throw data::InputError(file + ": found points more than 100 km from the robot's base, expected metres");
  return points;
}

SegmentedFolder segment_folder(const std::vector<RawView>& views, const std::vector<double>& times,
                               const SegmentFolderSettings& settings, const std::string& folder) {
  const int frames = static_cast<int>(times.empty() ? views.front().files.size() : times.size());
  for (const RawView& view : views)
    if (static_cast<int>(view.files.size()) != frames)
      throw data::input_error(view.folder, "frames",
                              "found " + std::to_string(view.files.size()) + ", expected " +
                                  std::to_string(frames) + ": one a time stamp, the same in every view");
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::seconds kQuiet(2);  // between two lines of progress
  Clock::time_point told = Clock::now();
  const auto tell = [&](const std::string& text) {
    if (!settings.told || Clock::now() - told < kQuiet) return;
    told = Clock::now();
    settings.told(text);
  };
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);  // what it has to say is said here
  SegmentedFolder result;
  if (settings.gripper) result.warnings = compare_clocks(times, *settings.gripper, settings.gripper_path);
  for (const RawView& view : views)
    result.warnings.insert(result.warnings.end(), view.warnings.begin(), view.warnings.end());
  const std::vector<CellFrame> sample = sampled_frames(views, times, settings.gripper);
  try {
    result.table = table_as_asked(sample, settings);
  } catch (const data::InputError&) {
    const std::string mistake = suspected_mistake(views, times, settings, true);
    if (mistake.empty()) throw;
    throw data::InputError(views.front().folder +
                           ": cameras, table and gripper are not of one cell: no table that stands still is "
                           "seen across the vertical" +
                           mistake);
  }
  expect_moving(views.front().folder, sample, settings);
  check_cell(views, times, sample, settings, result);
  const auto plane = result.table ? std::optional(result.table->plane) : std::nullopt;
  const std::set<StillCell> still = still_cells(sample, plane, settings.segment);
  constexpr double doubtful = 2 * M_PI / 180;
  if (result.table && result.table->tilt > doubtful) result.warnings.push_back(tilt_warning(*result.table));
  if (const std::string flange = plane ? flange_warning(*plane, times, settings) : ""; !flange.empty())
    result.warnings.push_back(flange);

  std::vector<LabelledFrame> shown;
  std::size_t with_cloth = 0, not_finite = 0;
  for (int k = 0; k < frames; ++k) {
    data::end_once(settings.stop);
    LabelledFrame frame{merged(views, k, true, not_finite), {}};
    ArmCylinder arm;
    arm.radius = settings.gripper ? settings.arm_radius : 0;
    if (settings.gripper) arm.tip = data::pose_at(*settings.gripper, times[k]).translation();
    Segmentation segmentation = segment_cloth(frame.points, plane, arm, settings.segment, still);
    tell("segmented " + std::to_string(k + 1) + " of " + std::to_string(frames) + " frames");
    with_cloth += segmentation.cloth.rows() > 0 ? 1 : 0;
    const int columns = std::min(frames, settings.picture_frames);
    const int next = static_cast<int>(shown.size());
    if (next < columns && k == (columns == 1 ? 0 : next * (frames - 1) / (columns - 1))) {
      frame.labels = segmentation.labels;
      if (!times.empty()) frame.time = times[k] - times.front();
      shown.push_back(std::move(frame));
    }
    segmentation.labels.clear();
    result.frames.push_back(std::move(segmentation));
  }
  if (with_cloth == 0)
    throw data::input_error(views.front().folder, "frames", no_cloth(result.frames, settings));
  if (not_finite > 0)
    result.warnings.push_back(data::format_count(not_finite) +
                              " points of the clouds are not finite and were left out");

  data::StagedFolder staged(folder);
  for (int k = 0; k < frames; ++k) {
    data::end_once(settings.stop);
    result.clouds.push_back(frame_name(k));
    data::save_point_cloud(result.frames[k].cloth, (fs::path(staged.path()) / result.clouds.back()).string());
  }
  result.picture = "segment.svg";
  data::write_atomically((fs::path(staged.path()) / result.picture).string(), draw_segmentation(shown));
  SegmentedCell cell;
  if (result.table) cell.table = {result.table->plane.point, result.table->plane.normal};
  cell.times = times;
  cell.cameras = places_of(views);
  if (settings.gripper) {
    cell.trajectory = (fs::path(staged.path()) / "gripper.tum").string();
    data::save_tum(*settings.gripper, cell.trajectory);
  }
  save_segmented_cell(cell, (fs::path(staged.path()) / "segment.json").string());
  data::end_once(settings.stop);
  staged.publish("segment.json");
  return result;
}

}  // namespace flash::sysid
