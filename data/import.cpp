#include "data/import.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numbers>

#include "data/atomic_file.h"
#include "data/error.h"
#include "data/json_reader.h"
#include "data/mesh_io.h"
#include "data/procedural_mesh.h"
#include "data/text.h"

namespace flash::data {
namespace {

namespace fs = std::filesystem;

InputError option_error(const char* option, const std::string& found, const std::string& expected) {
  return InputError("--" + std::string(option) + ": found \"" + found + "\", expected " + expected);
}

/// "frame2" before "frame10": runs of digits count as numbers.
bool natural_less(const std::string& a, const std::string& b) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!is_digit(a[i]) || !is_digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
      continue;
    }
    const auto digits = [&](const std::string& text, std::size_t& at) {
      std::size_t begin = at;
      while (at < text.size() && is_digit(text[at])) ++at;
      while (begin + 1 < at && text[begin] == '0') ++begin;
      return text.substr(begin, at - begin);
    };
    const std::string m = digits(a, i), n = digits(b, j);
    if (m.size() != n.size()) return m.size() < n.size();
    if (m != n) return m < n;
  }
  return a.size() - i < b.size() - j;
}

std::vector<std::string> files_in(const std::string& folder, const std::vector<std::string>& extensions,
                                  const char* option) {
  if (!fs::is_directory(folder))
    throw InputError(folder + ": is not a folder, expected one with the files of --" + option);
  std::vector<std::string> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && std::find(extensions.begin(), extensions.end(),
                                             lower_extension(entry.path().string())) != extensions.end())
      files.push_back(entry.path().string());
  if (files.empty()) throw InputError(folder + ": found no " + extensions.front() + " files for --" + option);
  std::sort(files.begin(), files.end(), natural_less);
  return files;
}

std::vector<double> parse_times(const std::string& times, std::size_t frames) {
  const std::string expected = "rate:HZ, rate:HZ:START or a CSV file with a column t";
  std::vector<double> result;
  if (times.starts_with("rate:")) {
    const std::vector<std::string_view> parts = split(times, ":");
    const std::optional<double> rate = parts.size() >= 2 ? parse_number(parts[1]) : std::nullopt;
    const std::optional<double> start = parts.size() == 3 ? parse_number(parts[2]) : 0.0;
    if (!rate || !start || parts.size() > 3 || !(*rate > 0) || !std::isfinite(*start))
      throw option_error("times", times, expected);
    for (std::size_t i = 0; i < frames; ++i) result.push_back(*start + static_cast<double>(i) / *rate);
    return result;
  }
  const std::string text = read_file(times);
  LineReader lines(text);
  std::string_view line;
  lines.next(line);
  const std::vector<std::string_view> names = split(line, ",");
  const auto column = std::find_if(names.begin(), names.end(),
                                   [](std::string_view name) { return name == "t" || name == "t_s"; });
  if (column == names.end())
    throw input_error(times, "header", "found \"" + std::string(line) + "\", expected a column t or t_s");
  const std::size_t index = static_cast<std::size_t>(column - names.begin());
  while (lines.next(line)) {
    if (line.empty()) continue;
    const std::vector<std::string_view> cells = split(line, ",");
    const std::optional<double> time =
        cells.size() == names.size() ? parse_number(cells[index]) : std::nullopt;
    if (!time || !std::isfinite(*time) || (!result.empty() && *time <= result.back()))
      throw input_error(times, "line " + std::to_string(lines.number()),
                        "found \"" + std::string(line) + "\", expected strictly increasing times");
    result.push_back(*time);
  }
  if (result.size() != frames)
    throw InputError(times + ": found " + std::to_string(result.size()) + " times, expected " +
                     std::to_string(frames) + ", one a frame");
  return result;
}

void parse_range(const std::string& range, const char* option, int axis, CropBox& crop) {
  if (range.empty()) return;
  const std::vector<std::string_view> ends = split(range, ":");
  const auto parse = [&](std::string_view end, double& bound) {
    if (end.empty()) return;
    const std::optional<double> value = parse_number(end);
    if (!value) throw option_error(option, range, "LOW:HIGH in metres, either side may be empty");
    bound = *value;
  };
  if (ends.size() != 2) throw option_error(option, range, "LOW:HIGH in metres, either side may be empty");
  parse(ends[0], crop.min[axis]);
  parse(ends[1], crop.max[axis]);
  if (!(crop.min[axis] < crop.max[axis])) throw option_error(option, range, "a low end below the high one");
}

std::string mesh_spec(const ImportOptions& options) {
  if (options.sheet.empty() == options.mesh.empty())
    throw InputError("import: expected either --sheet or --mesh");
  return options.mesh.empty() ? "sheet:" + options.sheet + ":" + format_number(options.cell) : options.mesh;
}

RecordedGrasp parse_grasp(const ImportOptions& options) {
  RecordedGrasp grasp;
  grasp.gripper = "gripper";
  grasp.shape = options.shape;
  grasp.select.within = options.within.value_or(1.2 * options.cell);
  const std::size_t colon = std::min(options.grasp.find(':'), options.grasp.size());
  const std::string kind = options.grasp.substr(0, colon);
  std::vector<int> indices;
  if (colon < options.grasp.size())
    for (const std::string_view word : split(std::string_view(options.grasp).substr(colon + 1), ",")) {
      const std::optional<long> index = parse_integer(word);
      if (!index || *index < 0)
        throw option_error("grasp", options.grasp, "whole numbers from 0 after the colon");
      indices.push_back(to_index(static_cast<double>(*index)));
    }
  if (kind == "corner" && (indices.empty() || (indices.size() == 2 && indices[0] <= 1 && indices[1] <= 1))) {
    grasp.select.corner =
        indices.empty() ? std::array<int, 2>{0, 0} : std::array<int, 2>{indices[0], indices[1]};
  } else if (kind == "vertices" && !indices.empty()) {
    grasp.select.vertices = indices;
  } else if (options.grasp == "position") {
    grasp.select.position = Eigen::Vector3d::Zero();
  } else {
    throw option_error("grasp", options.grasp,
                       "corner, corner:I,J with I and J 0 or 1, vertices:A,B,... or position");
  }
  return grasp;
}

/// Horizontal direction from the gripper's start to the middle of the cloth: the median over the frames,
/// which neither stray clusters nor frames that show a rim only can turn far.
double heading_of_clouds(const Recording& recording, const Eigen::Vector3d& gripper) {
  std::vector<double> x, y;
  std::vector<std::string> notices;
  for (const Keyframe& keyframe : load_keyframes(recording, notices)) {
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

/// Flat on the table, `corner` under the gripper, the diagonal from it along `heading`.
Eigen::Isometry3d start_pose(const Points& rest, const std::array<int, 2>& corner,
                             const Eigen::Vector3d& gripper, double table_height, double heading) {
  const Eigen::Vector3d low = rest.colwise().minCoeff(), high = rest.colwise().maxCoeff();
  Eigen::Vector3d from(corner[0] == 0 ? low.x() : high.x(), corner[1] == 0 ? low.y() : high.y(), low.z());
  const Eigen::Vector2d diagonal = (low + high - 2 * from).head<2>();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() =
      Eigen::AngleAxisd(heading - std::atan2(diagonal.y(), diagonal.x()), Eigen::Vector3d::UnitZ())
          .toRotationMatrix();
  pose.translation() = Eigen::Vector3d(gripper.x(), gripper.y(), table_height) - pose.linear() * from;
  return pose;
}

/// When the grasp acts at the latest: the first keyframe, or before it when the gripper sets off.
double grasp_time(const Trajectory& trajectory, double first_keyframe) {
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
  write_atomically(to.string(), read_file(file));
  return to.string();
}

std::string numbered(std::size_t index, const char* extension) {
  char name[32];
  std::snprintf(name, sizeof name, "%06zu%s", index, extension);
  return name;
}

/// Copies the frames below `out` and names them in the recording.
void import_frames(const ImportOptions& options, const fs::path& out, Recording& recording) {
  if (options.clouds.empty() == options.depth.empty())
    throw InputError("import: expected either a folder of clouds or --depth");
  const std::vector<std::string> frames = options.depth.empty()
                                              ? files_in(options.clouds, {".ply", ".pcd"}, "clouds")
                                              : files_in(options.depth, {".png"}, "depth");
  const std::vector<double> times = parse_times(options.times, frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    RecordedKeyframe keyframe;
    keyframe.time = times[i];
    if (options.depth.empty()) {
      keyframe.cloud = (out / "frames" / numbered(i, ".ply")).string();
      if (lower_extension(frames[i]) == ".ply")
        copied(frames[i], keyframe.cloud);
      else
        save_point_cloud(load_point_cloud(frames[i]), keyframe.cloud);
    } else {
      keyframe.depth = copied(frames[i], out / "depth" / numbered(i, ".png"));
      if (!options.masks.empty())
        keyframe.mask = copied((fs::path(options.masks) / fs::path(frames[i]).filename()).string(),
                               out / "mask" / numbered(i, ".png"));
    }
    recording.keyframes.push_back(keyframe);
  }
  if (options.depth.empty()) return;
  if (options.intrinsics.empty() || options.extrinsics.empty())
    throw InputError("import: --depth needs --intrinsics and --extrinsics");
  RecordedCamera camera;
  camera.intrinsics = load_camera_intrinsics(options.intrinsics);
  camera.intrinsics_path = (out / "camera_info.yaml").string();
  save_camera_info(camera.intrinsics, camera.intrinsics_path);
  camera.base_from_camera = load_extrinsics(options.extrinsics);
  camera.depth_scale = options.depth_scale;
  recording.camera = camera;
}

}  // namespace

Eigen::Isometry3d load_extrinsics(const std::string& path) {
  if (lower_extension(path) != ".json") return load_trajectory(path).poses.front();
  const nlohmann::json json = load_json(path);
  const JsonObject file(json, path);
  if (file.string("schema", "") != "flash-extrinsics/1") throw file.error("schema", "\"flash-extrinsics/1\"");
  const JsonObject transform = file.object("transform");
  transform.expect_fields({"parent", "child", "translation", "rotation_xyzw"});
  Eigen::Matrix<double, 7, 1> pose;
  pose.head<3>() = Eigen::Vector3d(transform.vector("translation", 3));
  pose.tail<4>() = Eigen::Vector4d(transform.vector("rotation_xyzw", 4));
  if (std::abs(pose.tail<4>().norm() - 1) > 1e-3) throw transform.error("rotation_xyzw", "a unit quaternion");
  return from_vector(pose);
}

Recording import_recording(const ImportOptions& options) {
  const fs::path out(options.out);
  const std::string path = (out / "recording.json").string();
  if (fs::exists(path) && !options.overwrite)
    throw InputError(path + ": exists already; choose another folder or --force");

  Recording recording;
  recording.source = path;
  recording.name =
      !options.name.empty() ? options.name : fs::weakly_canonical(fs::absolute(out)).filename().string();
  recording.kind = options.kind;
  recording.gravity = options.gravity;
  recording.nuisance = options.nuisance;
  recording.mesh_spec = mesh_spec(options);
  recording.mesh = is_mesh_spec(recording.mesh_spec) ? parse_mesh_spec(recording.mesh_spec, "import", "sheet")
                                                     : load_triangle_mesh(recording.mesh_spec);
  recording.grasps = {parse_grasp(options)};
  parse_range(options.crop_x, "crop-x", 0, recording.crop);
  parse_range(options.crop_y, "crop-y", 1, recording.crop);
  parse_range(options.crop_z, "crop-z", 2, recording.crop);
  const Trajectory trajectory = load_trajectory(options.trajectory);
  recording.trajectories["gripper"] = trajectory;

  import_frames(options, out, recording);
  recording.grasps[0].from = grasp_time(trajectory, recording.keyframes.front().time);
  recording.trajectory_paths["gripper"] = (out / "gripper.tum").string();
  save_tum(trajectory, recording.trajectory_paths["gripper"]);
  if (!is_mesh_spec(recording.mesh_spec))
    recording.mesh_spec = copied(recording.mesh_spec, out / fs::path(recording.mesh_spec).filename());
  if (!options.asset.empty()) recording.asset = options.asset;

  const Eigen::Vector3d gripper = trajectory.poses.front().translation();
  double table_height =
      std::min(gripper.z(), std::isfinite(recording.crop.min.z()) ? recording.crop.min.z() : gripper.z());
  std::vector<std::string> guesses;
  if (options.table_height)
    table_height = *options.table_height;
  else
    guesses.push_back("table height " + format_short(table_height) +
                      " m, from the gripper's start and the crop (--table)");
  recording.has_table = true;
  recording.table_point.z() = table_height;

  recording.start = recording.mesh.vertices;
  if (const auto& corner = recording.grasps[0].select.corner) {
    recording.base_from_object = start_pose(recording.mesh.vertices, *corner, gripper, table_height, 0);
    recording.start.rowwise() += Eigen::RowVector3d(gripper.x(), gripper.y(), table_height);
    double heading = options.heading.value_or(0);
    if (!options.heading) {
      heading = heading_of_clouds(recording, gripper);
      guesses.push_back("the sheet's diagonal points to " + format_short(heading * 180 / std::numbers::pi) +
                        " deg from x, where the clouds are (--heading)");
    }
    recording.base_from_object = start_pose(recording.mesh.vertices, *corner, gripper, table_height, heading);
    guesses.push_back("the sheet starts flat on the table, its corner under the gripper");
  }
  save_recording(recording, path);
  try {
    Recording checked = load_recording(path);
    load_keyframes(checked, checked.notices);
    for (const std::string& guess : guesses) checked.notices.push_back(path + ": guessed: " + guess);
    return checked;
  } catch (const InputError&) {
    fs::remove(path);
    throw;
  }
}

}  // namespace flash::data
