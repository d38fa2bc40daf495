#include "data/motion/pose_file.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "data/files/yaml_file.h"
#include "data/motion/bare_poses.h"
#include "data/motion/pose_json.h"
#include "data/motion/pose_npz.h"
#include "data/motion/pose_numbers.h"
#include "data/motion/pose_table.h"
#include "data/motion/trajectory.h"

namespace flash::data {
namespace {

void expect_plausible(const std::vector<RecordedPose>& poses, const std::string& path) {
  std::vector<double> distances;
  for (const RecordedPose& pose : poses) distances.push_back(pose.pose.translation().stableNorm());
  expect_metres(distances, path);
}

/// The words of the first line that holds any but comments.
std::vector<std::string> first_words(const std::string& path) {
  const std::string text = read_text(path);
  LineReader lines(text);
  for (std::string_view line; lines.next(line);) {
    if (trimmed(line).empty() || line.front() == '#') continue;
    std::vector<std::string> words;
    for (const std::string_view word : split(line, " \t\r,;[]()"))
      if (!word.empty()) words.emplace_back(word);
    return words;
  }
  throw InputError(path + ": found no poses");
}

/// EuRoC's header stands behind the mark of a comment.
bool is_commented_header(std::string_view line) {
  if (line.front() != '#') return false;
  const std::vector<std::string_view> cells = split(line, ",;");
  return std::any_of(cells.begin(), cells.end(), [](std::string_view cell) {
    const std::string name = column_name(trimmed(cell));
    return name == "tx" || name == "tx_mm";
  });
}

bool has_header(const std::string& path) {
  const std::string text = read_text(path);
  LineReader lines(text);
  for (std::string_view line; lines.next(line);) {
    if (trimmed(line).empty()) continue;
    if (line.front() != '#') break;
    if (is_commented_header(line)) return true;
  }
  const std::vector<std::string> words = first_words(path);
  return !words.empty() && !parse_number(words.front());
}

Eigen::Vector3d xyz(const YAML::Node& node, const std::string& path, const std::string& field) {
  return {yaml_number(node["x"], path, field + ".x"), yaml_number(node["y"], path, field + ".y"),
          yaml_number(node["z"], path, field + ".z")};
}

/// {translation, rotation} or {position, orientation}, each with named parts.
Eigen::Isometry3d named_pose(const YAML::Node& node, const std::string& path, const std::string& field) {
  const bool ros_pose = node.IsMap() && node["position"];
  const char* const first = ros_pose ? "position" : "translation";
  const char* const second = ros_pose ? "orientation" : "rotation";
  if (!node.IsMap() || !node[first] || !node[first].IsMap() || !node[second] || !node[second].IsMap())
    throw input_error(path, field, "expected translation {x, y, z} and rotation {x, y, z, w}");
  const Eigen::Vector3d axis = xyz(node[second], path, field + '.' + second);
  return pose_of(
      xyz(node[first], path, field + '.' + first),
      {axis.x(), axis.y(), axis.z(), yaml_number(node[second]["w"], path, field + '.' + second + ".w")}, path,
      field);
}

std::string names_in(const YAML::Node& node) {
  if (!node.IsMap()) return "no names";
  std::string names;
  for (const auto& entry : node) names += (names.empty() ? "" : ", ") + entry.first.Scalar();
  return names;
}

std::vector<PosePair> load_samples(const std::string& path) {
  const YAML::Node file = load_yaml(path);
  const YAML::Node samples = file.IsMap() ? file["samples"] : file;
  if (!samples.IsDefined() || !samples.IsSequence())
    throw input_error(path, "samples", "missing, expected a list of {robot, tracking}");
  std::vector<PosePair> pairs;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const std::string field = "samples[" + std::to_string(i) + "]";
    const YAML::Node sample = samples[i];
    if (!sample.IsMap() || !sample["robot"] || !sample["tracking"])
      throw input_error(path, field, "found " + names_in(sample) + ", expected robot and tracking");
    pairs.push_back({named_pose(sample["robot"], path, field + ".robot"),
                     named_pose(sample["tracking"], path, field + ".tracking")});
  }
  return pairs;
}

}  // namespace

bool is_tum(const std::string& path) {
  const std::string extension = lower_extension(path);
  if (extension == ".csv" || extension == ".json") return false;
  if (extension == ".tum") return true;
  const std::string text = read_text(path);
  return text.find(',') == std::string::npos && text.find(';') == std::string::npos &&
         first_words(path).size() == 8;
}

std::optional<long> number_in_name(const std::string& path) {
  const std::string name = std::filesystem::path(path).stem().string();
  const std::size_t end = name.find_last_of("0123456789");
  if (end == std::string::npos) return std::nullopt;
  std::size_t begin = end;
  while (begin > 0 && std::isdigit(static_cast<unsigned char>(name[begin - 1]))) --begin;
  return parse_integer(name.substr(begin, end + 1 - begin));
}

PoseList load_pose_list(const std::string& path) {
  const std::string extension = lower_extension(path);
  if (extension == ".json") return load_json_poses(path);
  if (extension == ".npz") return load_npz_poses(path);
  if (extension == ".npy") return load_npy_poses(path);
  PoseList list;
  if (extension == ".samples") {
    for (const PosePair& pair : load_samples(path))
      list.poses.push_back({"", static_cast<double>(list.poses.size()), pair.T_base_gripper});
    list.in_order = true;
    list.guess = path + ": its samples are taken to be in the order of the pictures";
  } else if (!is_tum(path)) {
    if (!has_header(path)) return load_bare_poses(path);
    list = load_pose_table(path);
  } else {
    const Trajectory trajectory = load_tum(path);
    list.timed = true;
    for (std::size_t i = 0; i < trajectory.times.size(); ++i)
      list.poses.push_back({"", trajectory.times[i], trajectory.poses[i]});
  }
  expect_plausible(list.poses, path);
  return list;
}

Eigen::Isometry3d load_yaml_pose(const std::string& path) {
  Eigen::Isometry3d pose;
  YAML::Node file = load_yaml(path);
  if (file.IsMap() && file.size() == 1 && !file.begin()->second.IsScalar()) file = file.begin()->second;
  for (const char* name : {"pose", "transform"})  // of ROS's stamped messages
    if (file.IsMap() && file[name]) file = file[name];
  if (file.IsMap() && file["qw"]) {
    pose = pose_of(xyz(file, path, "pose"),
                   {yaml_number(file["qx"], path, "qx"), yaml_number(file["qy"], path, "qy"),
                    yaml_number(file["qz"], path, "qz"), yaml_number(file["qw"], path, "qw")},
                   path, "pose");
  } else if (file.IsMap() && file["data"]) {
    pose = pose_of_numbers(yaml_numbers(file["data"], path, "data"), path, "data");
  } else if (file.IsMap()) {
    pose = named_pose(file, path, "pose");
  } else {
    pose = pose_of_numbers(yaml_numbers(file, path, "pose"), path, "pose");
  }
  expect_metres({pose.translation().stableNorm()}, path);
  return pose;
}

RecordedPose load_pose_yaml(const std::string& path) {
  const std::optional<long> stamp = number_in_name(path);
  if (!stamp) throw InputError(path + ": found no number in the file name, expected that of its image");
  return {"", static_cast<double>(*stamp), load_yaml_pose(path)};
}

std::vector<PosePair> load_pose_pairs(const std::string& path) {
  const std::string ending = lower_extension(path);
  const std::vector<PosePair> pairs = ending == ".json"  ? load_json_pairs(path)
                                      : ending == ".npz" ? load_npz_pairs(path)
                                                         : load_samples(path);
  if (pairs.empty()) throw InputError(path + ": found no samples");
  std::vector<double> robot, tracking;
  for (const PosePair& pair : pairs) {
    robot.push_back(pair.T_base_gripper.translation().stableNorm());
    tracking.push_back(pair.T_camera_target.translation().stableNorm());
  }
  expect_metres(robot, path);
  expect_metres(tracking, path);
  return pairs;
}

}  // namespace flash::data
