#include "sysid/capture/import.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numbers>

#include "data/asset/asset.h"
#include "data/camera/depth_map.h"
#include "data/camera/extrinsics.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/staged_folder.h"
#include "data/files/stop.h"
#include "data/files/text.h"
#include "data/files/writable.h"
#include "data/mesh/mesh_io.h"
#include "data/mesh/procedural_mesh.h"
#include "sysid/capture/clocks.h"
#include "sysid/capture/import_checks.h"
#include "sysid/capture/import_picture.h"
#include "sysid/capture/lying_checks.h"
#include "sysid/replay/grasp_mesh.h"

namespace flash::sysid {
namespace {

namespace fs = std::filesystem;

/// Horizontal direction from the gripper's start to the middle of the cloth: the median over the frames,
/// which neither stray clusters nor frames that show a rim only can turn far.
double heading_of_clouds(const std::vector<data::Keyframe>& keyframes, const Eigen::Vector3d& gripper) {
  std::vector<double> x, y;
  for (const data::Keyframe& keyframe : keyframes) {
    if (keyframe.cloud.rows() == 0) continue;
    x.push_back(keyframe.cloud.col(0).mean() - gripper.x());
    y.push_back(keyframe.cloud.col(1).mean() - gripper.y());
  }
  const auto median = [](std::vector<double>& values) {
    const auto middle = values.begin() + static_cast<long>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  };
  return x.empty() ? 0.0 : std::atan2(median(y), median(x));
}

Eigen::RowVector3d corner_of(const data::Points& rest, const std::array<int, 2>& corner) {
  const Eigen::RowVector3d low = rest.colwise().minCoeff(), high = rest.colwise().maxCoeff();
  return {corner[0] == 0 ? low.x() : high.x(), corner[1] == 0 ? low.y() : high.y(), low.z()};
}

/// Flat on the table, the point `held` of the rest sheet under the gripper, the diagonal from `corner` along
/// `heading`.
Eigen::Isometry3d start_pose(const data::Points& rest, const std::array<int, 2>& corner,
                             const Eigen::RowVector3d& held, const Eigen::Vector3d& gripper,
                             double table_height, double heading) {
  const Eigen::RowVector3d diagonal =
      rest.colwise().minCoeff() + rest.colwise().maxCoeff() - 2 * corner_of(rest, corner);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() =
      Eigen::AngleAxisd(heading - std::atan2(diagonal.y(), diagonal.x()), Eigen::Vector3d::UnitZ())
          .toRotationMatrix();
  pose.translation() =
      Eigen::Vector3d(gripper.x(), gripper.y(), table_height) - pose.linear() * held.transpose();
  return pose;
}

/// Loads the recording as its users will, which checks it; what is wrong is not yet in a file of the user.
/// `doubt` is said where the grasp is wrong.
void check_as_file(const data::Recording& recording, const std::string& path, const std::string& doubt) {
  data::save_recording(recording, path);
  try {
    data::load_recording(path);
  } catch (const data::InputError& error) {
    std::string message = error.what();
    if (message.starts_with(path)) message.replace(0, path.size(), "import");
    if (message.starts_with("import: grasps")) message += doubt;
    throw data::InputError(message);
  }
}

/// When the grasp acts at the latest: the first keyframe, or before it when the gripper sets off.
double grasp_time(const data::Trajectory& trajectory, double first_keyframe) {
  constexpr double kStill = 1e-3;  // [m]
  const Eigen::Vector3d start = trajectory.poses.front().translation();
  double last = trajectory.times.front();
  for (std::size_t i = 0; i < trajectory.times.size(); ++i) {
    if ((trajectory.poses[i].translation() - start).norm() > kStill) break;
    last = trajectory.times[i];
  }
  return std::min(first_keyframe, last);
}

std::string copied(const std::string& file, const fs::path& to) {
  data::write_atomically(to.string(), data::read_file(file));
  return to.string();
}

std::string numbered(std::size_t index, const char* extension) {
  char name[32];
  std::snprintf(name, sizeof name, "%06zu%s", index, extension);
  return name;
}

/// Names the frames, where they are, in the recording.
void import_frames(const ImportSettings& settings, data::Recording& recording) {
  const bool depth = !settings.depth.empty();
  const std::vector<std::string>& frames = depth ? settings.depth : settings.clouds;
  if (frames.empty()) throw data::InputError("import: found no frames, expected clouds or depth images");
  if (!settings.times.empty() && settings.times.size() != frames.size())
    throw data::InputError("import: found " + std::to_string(settings.times.size()) + " times, expected " +
                           std::to_string(frames.size()) + ", one a frame");
  for (std::size_t i = 0; i < frames.size(); ++i) {
    data::RecordedKeyframe keyframe;
    keyframe.time = settings.times.empty() ? static_cast<double>(i) / ImportSettings::frames_per_second
                                           : settings.times[i];
    (depth ? keyframe.depth : keyframe.cloud) = frames[i];
    if (!settings.masks.empty()) keyframe.mask = data::mask_of(settings.masks, frames[i]);
    recording.keyframes.push_back(keyframe);
  }
  if (!depth) return;
  data::RecordedCamera camera;
  const data::CameraPose pose = data::load_camera_pose(settings.extrinsics, settings.accept_unusable);
  std::optional<data::LensOfFile> own;
  if (!settings.intrinsics.empty())
    own = {data::load_depth_lens(settings.intrinsics, settings.depth.front()), settings.intrinsics};
  const data::PosedLens lens = data::posed_lens(pose, settings.extrinsics, own, settings.lens);
  if (!lens.notice.empty()) recording.notices.push_back(lens.notice);
  camera.intrinsics = lens.lens;
  camera.base_from_camera = pose.transform.T;
  camera.warnings = pose.warnings;
  if (!pose.usable)
    camera.warnings.insert(camera.warnings.begin(),
                           "flash-calib handeye ended with exit code 3, an answer that cannot be used");
  for (const std::string& warning : camera.warnings)
    recording.notices.push_back(settings.extrinsics + ": " + warning);
  camera.depth_scale = settings.depth_scale;
  recording.camera = camera;
}

/// Copies all that the recording names below `out`, and names the copies.
void copy_files(const fs::path& out, const std::atomic<bool>* stop, data::Recording& recording) {
  for (std::size_t i = 0; i < recording.keyframes.size(); ++i) {
    data::end_once(stop);
    data::RecordedKeyframe& keyframe = recording.keyframes[i];
    if (!keyframe.depth.empty())
      keyframe.depth =
          copied(keyframe.depth, out / "depth" / numbered(i, data::lower_extension(keyframe.depth).c_str()));
    if (!keyframe.mask.empty()) keyframe.mask = copied(keyframe.mask, out / "mask" / numbered(i, ".png"));
    if (keyframe.cloud.empty()) continue;
    const std::string copy = (out / "frames" / numbered(i, ".ply")).string();
    if (data::lower_extension(keyframe.cloud) == ".ply")
      copied(keyframe.cloud, copy);
    else
      data::save_point_cloud(data::load_point_cloud(keyframe.cloud), copy);
    keyframe.cloud = copy;
  }
  if (recording.camera) {
    recording.camera->intrinsics_path = (out / "camera_info.yaml").string();
    data::save_camera_info(recording.camera->intrinsics, recording.camera->intrinsics_path);
  }
  for (auto& [name, path] : recording.trajectory_paths) {
    path = (out / (name + ".tum")).string();
    data::save_tum(recording.trajectories.at(name), path);
  }
  if (!data::is_mesh_spec(recording.mesh_spec))
    recording.mesh_spec = copied(recording.mesh_spec, out / fs::path(recording.mesh_spec).filename());
}

}  // namespace

data::Recording import_recording(const ImportSettings& settings) {
  const fs::path out(settings.out);
  const std::string path = (out / "recording.json").string();
  std::vector<std::string> names = {"recording.json",   "frames",      "depth",     "mask",
                                    "camera_info.yaml", "gripper.tum", "import.svg"};
  if (!data::is_mesh_spec(settings.mesh_spec))
    names.push_back(fs::path(settings.mesh_spec).filename().string());
  data::check_names_free(settings.out, names, settings.overwrite);

  data::Recording recording;
  recording.source = "import";
  recording.name =
      !settings.name.empty() ? settings.name : fs::weakly_canonical(fs::absolute(out)).filename().string();
  recording.kind = settings.kind;
  recording.gravity = settings.gravity;
  recording.nuisance = settings.nuisance;
  recording.mesh_spec = settings.mesh_spec;
  recording.mesh = settings.mesh;
  data::RecordedGrasp grasp;
  grasp.gripper = "gripper";
  grasp.select = settings.grasp;
  grasp.shape = settings.shape;
  recording.grasps = {grasp};
  recording.crop = settings.crop;
  const data::Trajectory& trajectory = settings.trajectory;
  if (trajectory.poses.size() < 2)
    throw data::InputError("import: found " + std::to_string(trajectory.poses.size()) +
                           " poses of the gripper, expected two or more");
  recording.trajectories["gripper"] = trajectory;
  recording.trajectory_paths["gripper"] = settings.trajectory_path;

  check_patch(recording);
  import_frames(settings, recording);
  recording.grasps[0].from = grasp_time(trajectory, recording.keyframes.front().time);
  std::vector<double> times;
  for (const data::RecordedKeyframe& keyframe : recording.keyframes) times.push_back(keyframe.time);
  std::vector<std::string> notices = recording.notices;
  for (const std::string& line : compare_clocks(times, trajectory, settings.trajectory_path))
    notices.push_back(line);

  if (const std::string question = questioned_settings(recording); !question.empty())
    notices.push_back("import: warning: " + question.substr(question.find(": ") + 2));

  std::vector<std::string> guesses;
  if (settings.times.empty()) guesses.push_back("10 frames a second (--times)");
  const Eigen::Vector3d gripper = trajectory.poses.front().translation();
  double table_height =
      std::min(gripper.z(), std::isfinite(recording.crop.min.z()) ? recording.crop.min.z() : gripper.z());
  if (settings.table_height)
    table_height = *settings.table_height;
  else
    guesses.push_back("table height " + data::format_short(table_height) +
                      " m, from the gripper's start and the crop (--table-z)");
  constexpr double kKnown = 5e-3;  // what a table's height is known to [m]
  if (gripper.z() < table_height - kKnown)
    notices.push_back("import: warning: --table-z: found " + data::format_short(table_height) +
                      " m, expected at most the height at which the gripper starts, " +
                      data::format_short(gripper.z()) + " m: does it grasp below the table?");
  recording.has_table = true;
  recording.table_point.z() = table_height;

  recording.start = recording.mesh.vertices;
  const auto& corner = recording.grasps[0].select.corner;
  if (corner) recording.start.rowwise() += Eigen::RowVector3d(gripper.x(), gripper.y(), table_height);
  const std::vector<data::Keyframe> keyframes = data::load_keyframes(recording, notices);
  std::optional<LyingSheet> sheet;
  if (corner) {
    const data::Points& rest = recording.mesh.vertices;
    Eigen::RowVector3d held = corner_of(rest, *corner);
    if (settings.tool_at_patch) held = patch_middle(recording, recording.grasps[0]);
    const double heading = settings.heading.value_or(heading_of_clouds(keyframes, gripper));
    recording.base_from_object = start_pose(rest, *corner, held, gripper, table_height, heading);
    sheet = stated_sheet(recording, heading);
    if (sheet && sheet->right != sheet->left) notices.push_back(sides_taken(*sheet));
    if (!settings.heading)
      guesses.push_back("the sheet's diagonal points to " +
                        data::format_short(heading * 180 / std::numbers::pi) +
                        " deg from x, where the clouds are; a few degrees off are usual: give --heading DEG, "
                        "or --start-yaw-bound 0.2 here and --start-yaw as an axis of grid");
    guesses.push_back("the sheet starts flat on the table, " +
                      std::string(settings.tool_at_patch ? "the middle of the grasped patch" : "its corner") +
                      " under the gripper (--tool-at)");
  }

  std::string doubt = corner && !settings.table_height
                          ? "; or the table's height, guessed as " + data::format_short(table_height) +
                                " m from the gripper's start and the crop, is wrong: give it as --table-z"
                          : "";
  if (const std::string flange = flange_doubt(recording); corner && !flange.empty()) doubt += "; " + flange;
  if (const std::string approach = approach_of(trajectory); corner && !approach.empty())
    doubt += "; " + approach;
  data::StagedFolder staged(settings.out);
  copy_files(staged.path(), settings.stop, recording);
  check_as_file(recording, (fs::path(staged.path()) / "recording.json").string(), doubt);
  std::vector<std::string> found = contradictions(recording, keyframes);
  if (sheet) {
    constexpr double kByEye = 0.1, kGuessed = 0.35;  // what a heading is known to [rad]
    const std::string swapped =
        swapped_sides(recording, keyframes, *sheet, settings.heading ? kByEye : kGuessed);
    for (const std::string& text : {swapped, beside_the_sheet(recording, keyframes, *sheet)})
      if (!text.empty())
        settings.heading ? found.push_back(text) : notices.push_back("import: warning: " + text);
    if (swapped.empty())
      for (const std::string& line : compare_sides(recording, keyframes, *sheet)) notices.push_back(line);
  }
  for (const std::string& text : found) {
    if (!settings.accept_unusable)
      throw data::InputError("import: " + text + " --despite-doubts takes it as it is");
    notices.push_back("import: warning: " + text);
  }
  if (!settings.asset.empty()) {
    if (!fs::exists(settings.asset))
      throw data::InputError("--asset: found \"" + settings.asset + "\", expected a file");
    data::load_asset(settings.asset);  // says what is wrong with it
    // Named as from the place where the recording will stand.
    recording.asset = (fs::path(staged.path()) / data::relative_path(settings.asset, path)).string();
  }
  data::save_recording(recording, (fs::path(staged.path()) / "recording.json").string());
  std::vector<Eigen::Vector3d> cameras = settings.cameras;
  if (recording.camera) cameras.emplace_back(recording.camera->base_from_camera.translation());
  data::write_atomically((fs::path(staged.path()) / "import.svg").string(),
                         draw_import(recording, keyframes, cameras));
  data::end_once(settings.stop);
  staged.publish("recording.json");
  data::Recording written = data::load_recording(path);
  written.notices.insert(written.notices.end(), notices.begin(), notices.end());
  for (const std::string& text : settings.taken) written.notices.push_back("import: " + text);
  for (const std::string& guess : guesses) written.notices.push_back("import: guessed: " + guess);
  return written;
}

}  // namespace flash::sysid
