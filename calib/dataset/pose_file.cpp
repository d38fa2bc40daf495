#include "calib/dataset/pose_file.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>

#include "calib/dataset/bare_poses.h"
#include "calib/dataset/pose_json.h"
#include "calib/dataset/pose_numbers.h"
#include "calib/dataset/yaml_file.h"
#include "calib/geometry/pose.h"
#include "data/atomic_file.h"
#include "data/error.h"
#include "data/text.h"
#include "data/trajectory.h"

namespace flash::calib {
namespace {

using data::input_error;
using data::InputError;
using Columns = std::map<std::string, std::size_t>;

void expect_plausible(const std::vector<RecordedPose>& poses, const std::string& path) {
  std::vector<double> distances;
  for (const RecordedPose& pose : poses) distances.push_back(pose.pose.translation().stableNorm());
  expect_metres(distances, path);
}

std::string trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\"#"), end = text.find_last_not_of(" \t\r\"");
  return begin == std::string_view::npos ? std::string() : std::string(text.substr(begin, end + 1 - begin));
}

/// The name of a column as we call it: EuRoC and others say it in more words.
std::string column_name(const std::string& header) {
  std::string name = header.substr(0, header.find(" ["));
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  static const std::map<std::string, std::string> aliases = {{"x", "tx"},
                                                             {"y", "ty"},
                                                             {"z", "tz"},
                                                             {"p_rs_r_x", "tx"},
                                                             {"p_rs_r_y", "ty"},
                                                             {"p_rs_r_z", "tz"},
                                                             {"q_rs_w", "qw"},
                                                             {"q_rs_x", "qx"},
                                                             {"q_rs_y", "qy"},
                                                             {"q_rs_z", "qz"},
                                                             {"timestamp", "t"},
                                                             {"time", "t"},
                                                             {"stamp", "t"},
                                                             {"frame", "index"},
                                                             {"id", "index"},
                                                             {"file", "image"},
                                                             {"filename", "image"},
                                                             {"name", "image"},
                                                             {"picture", "image"},
                                                             {"x_mm", "tx_mm"},
                                                             {"y_mm", "ty_mm"},
                                                             {"z_mm", "tz_mm"},
                                                             {"a", "rx_deg"},  // KUKA's, about turning ZYX
                                                             {"b", "ry_deg"},
                                                             {"c", "rz_deg"},
                                                             {"roll", "rx"},
                                                             {"pitch", "ry"},
                                                             {"yaw", "rz"},
                                                             {"roll_deg", "rx_deg"},
                                                             {"pitch_deg", "ry_deg"},
                                                             {"yaw_deg", "rz_deg"}};
  const auto found = aliases.find(name);
  return found == aliases.end() ? name : found->second;
}

/// The cells of a CSV line, by the names of its columns.
struct CsvLine {
  const std::string& path;
  const Columns& columns;
  std::vector<std::string> cells;
  int number;

  bool has(const std::string& column) const { return columns.count(column) > 0; }
  const std::string& text(const std::string& column) const { return cells[columns.at(column)]; }
  double value(const std::string& column) const {
    const std::optional<double> found = data::parse_number(text(column));
    if (!found || !std::isfinite(*found))
      throw input_error(path, "line " + std::to_string(number) + ", " + column,
                        "found \"" + text(column) + "\", expected a finite number");
    return *found;
  }
  Eigen::Vector3d vector(const std::array<const char*, 3>& names, const std::string& ending = "") const {
    return {value(names[0] + ending), value(names[1] + ending), value(names[2] + ending)};
  }
};

bool names_pictures(const Columns& columns) {
  return columns.count("image") + columns.count("index") + columns.count("t") > 0;
}

/// To which picture the line belongs; without a column that says so, to that of its place.
void read_picture(const CsvLine& line, RecordedPose& pose) {
  if (!names_pictures(line.columns)) return;
  if (line.has("image"))
    pose.image = line.text("image");
  else
    pose.stamp = line.value(line.has("index") ? "index" : "t");
  if (std::abs(pose.stamp) > 1e14) pose.stamp *= 1e-9;  // EuRoC counts nanoseconds
}

RecordedPose pose_of_line(const CsvLine& line) {
  RecordedPose pose;
  const std::string where = "line " + std::to_string(line.number);
  const Eigen::Vector3d translation = line.has("tx_mm")
                                          ? Eigen::Vector3d(1e-3 * line.vector({"tx", "ty", "tz"}, "_mm"))
                                          : line.vector({"tx", "ty", "tz"});
  if (line.has("qw")) {
    const Eigen::Vector3d axis = line.vector({"qx", "qy", "qz"});
    pose.pose = pose_of(translation, {axis.x(), axis.y(), axis.z(), line.value("qw")}, line.path, where);
  } else {
    Eigen::Matrix3d rotation;
    if (line.has("rotvec_x")) {
      const Eigen::Vector3d vector = line.vector({"rotvec_x", "rotvec_y", "rotvec_z"});
      rotation = Eigen::AngleAxisd(vector.norm(), vector.norm() > 0 ? Eigen::Vector3d(vector.normalized())
                                                                    : Eigen::Vector3d::UnitX().eval())
                     .toRotationMatrix();
    } else {
      const bool degrees = line.has("rx_deg");
      pose.angles = line.vector({"rx", "ry", "rz"}, degrees ? "_deg" : "") * (degrees ? M_PI / 180 : 1);
      if (!degrees && pose.angles->cwiseAbs().maxCoeff() > 2 * M_PI + 1e-6)
        throw input_error(line.path, where,
                          "angle of " + data::format_short(pose.angles->cwiseAbs().maxCoeff()) +
                              " rad is beyond a full turn (degrees? name the columns rx_deg ry_deg rz_deg)");
      rotation = rotation_from_angles(*pose.angles);
    }
    pose.pose.linear() = rotation;
    pose.pose.translation() = translation;
  }
  read_picture(line, pose);
  return pose;
}

/// In the order of the file.
std::string names_in(const Columns& columns) {
  std::vector<std::pair<std::size_t, std::string>> ordered;
  for (const auto& [name, place] : columns) ordered.emplace_back(place, name);
  std::sort(ordered.begin(), ordered.end());
  std::string names;
  for (const auto& [place, name] : ordered) names += (names.empty() ? "" : ", ") + name;
  return names;
}

void expect_columns(const Columns& columns, const std::string& path) {
  const auto all = [&](std::initializer_list<const char*> names) {
    return std::all_of(names.begin(), names.end(), [&](const char* name) { return columns.count(name) > 0; });
  };
  if (!all({"tx", "ty", "tz"}) && !all({"tx_mm", "ty_mm", "tz_mm"})) {
    const bool joints = all({"q1"}) || std::any_of(columns.begin(), columns.end(), [](const auto& column) {
                          return column.first.find("joint") != std::string::npos;
                        });
    throw input_error(path, "header",
                      "found " + names_in(columns) +
                          ", expected tx, ty, tz [m] (or x, y, z), or tx_mm, ty_mm, tz_mm" +
                          (joints ? "; joints need --robot with their URDF" : ""));
  }
  if (!all({"qx", "qy", "qz", "qw"}) && !all({"rx", "ry", "rz"}) && !all({"rx_deg", "ry_deg", "rz_deg"}) &&
      !all({"rotvec_x", "rotvec_y", "rotvec_z"}))
    throw input_error(path, "header",
                      "found " + names_in(columns) +
                          ", and with them no rotation, expected qx,qy,qz,qw or rx,ry,rz or "
                          "rotvec_x,rotvec_y,rotvec_z");
}

/// Reads the lines below a header; `check` looks at its columns, `read` makes a pose of each line.
template <class Check, class Read>
PoseList read_csv(const std::string& path, const Check& check, const Read& read) {
  const std::string text = read_text(path);
  PoseList list;
  Columns columns;
  const char* separator = ",";
  data::LineReader lines(text);
  for (std::string_view line; lines.next(line);) {
    if (trimmed(line).empty() || (!columns.empty() && line.front() == '#')) continue;
    if (columns.empty() && line.find(';') != std::string_view::npos) separator = ";";
    std::vector<std::string> cells;
    for (const std::string_view cell : data::split(line, separator)) cells.push_back(trimmed(cell));
    if (columns.empty()) {
      for (std::size_t c = 0; c < cells.size(); ++c) columns[column_name(cells[c])] = c;
      check(columns);
      continue;
    }
    if (cells.size() < columns.size())
      throw input_error(
          path, "line " + std::to_string(lines.number()),
          "found " + std::to_string(cells.size()) + " columns, expected " + std::to_string(columns.size()));
    list.poses.push_back(read(CsvLine{path, columns, std::move(cells), lines.number()}));
    if (!names_pictures(columns)) list.poses.back().stamp = static_cast<double>(list.poses.size() - 1);
  }
  if (list.poses.empty()) throw InputError(path + ": found no poses below its header");
  list.in_order = !names_pictures(columns);
  if (list.in_order)
    list.guess =
        path + ": no column image, index or t; its lines are taken to be in the order of the pictures";
  return list;
}

PoseList load_csv(const std::string& path) {
  return read_csv(
      path, [&](const Columns& columns) { expect_columns(columns, path); }, pose_of_line);
}

/// Columns of the joints that move: by their names, else q1 q2 ...; in degrees where they end so.
std::vector<std::string> joint_columns(const Columns& columns, const SerialChain& robot,
                                       const std::string& path) {
  std::vector<std::string> names = moving_joints(robot), found;
  for (std::size_t k = 0; k < names.size(); ++k)
    for (const std::string& name : {column_name(names[k]), "q" + std::to_string(k + 1)})
      for (const std::string& column : {name, name + "_deg"})
        if (found.size() == k && columns.count(column) > 0) found.push_back(column);
  if (found.size() == names.size()) return found;
  throw input_error(path, "header",
                    "found no column of joint " + names[found.size()] + ", expected " + names[found.size()] +
                        " or q" + std::to_string(found.size() + 1) +
                        " [rad], or the same with the ending _deg");
}

/// The words of the first line that holds any but comments.
std::vector<std::string> first_words(const std::string& path) {
  const std::string text = read_text(path);
  data::LineReader lines(text);
  for (std::string_view line; lines.next(line);) {
    if (trimmed(line).empty() || line.front() == '#') continue;
    std::vector<std::string> words;
    for (const std::string_view word : data::split(line, " \t\r,;[]()"))
      if (!word.empty()) words.emplace_back(word);
    return words;
  }
  throw InputError(path + ": found no poses");
}

bool has_header(const std::string& path) {
  const std::vector<std::string> words = first_words(path);
  return !words.empty() && !data::parse_number(words.front());
}

/// Eight values parted by blanks are TUM's in a file of any name.
bool is_tum(const std::string& path) {
  if (data::lower_extension(path) == ".csv") return false;
  const std::string text = read_text(path);
  return text.find(',') == std::string::npos && text.find(';') == std::string::npos &&
         first_words(path).size() == 8;
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

Eigen::Matrix3d rotation_from_angles(const Eigen::Vector3d& angles, const std::string& order) {
  if (order == kRotationVector) return rotation_exp(angles);
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  for (int k = 0; k < 3; ++k) {
    const char axis = order[static_cast<std::size_t>(k)];
    const bool turning = axis < 'a';
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(angles[k], Eigen::Vector3d::Unit(axis - (turning ? 'X' : 'x'))).toRotationMatrix();
    rotation = turning ? Eigen::Matrix3d(rotation * turn) : Eigen::Matrix3d(turn * rotation);
  }
  return rotation;
}

const std::vector<std::string>& angle_orders() {
  static const std::vector<std::string> orders = [] {
    std::vector<std::string> list;
    for (const char* order :
         {"xyz", "xzy", "yxz", "yzx", "zxy", "zyx", "xyx", "xzx", "yxy", "yzy", "zxz", "zyz"}) {
      list.emplace_back(order);
      std::string turning = order;
      for (char& axis : turning) axis = static_cast<char>(axis - 'x' + 'X');
      list.push_back(turning);
    }
    list.emplace_back(kRotationVector);
    return list;
  }();
  return orders;
}

std::optional<long> number_in_name(const std::string& path) {
  const std::string name = std::filesystem::path(path).stem().string();
  const std::size_t end = name.find_last_of("0123456789");
  if (end == std::string::npos) return std::nullopt;
  std::size_t begin = end;
  while (begin > 0 && std::isdigit(static_cast<unsigned char>(name[begin - 1]))) --begin;
  return data::parse_integer(name.substr(begin, end + 1 - begin));
}

PoseList load_pose_list(const std::string& path) {
  const std::string extension = data::lower_extension(path);
  if (extension == ".json") return load_json_poses(path);
  PoseList list;
  if (extension == ".samples") {
    for (const PosePair& pair : load_samples(path))
      list.poses.push_back({"", static_cast<double>(list.poses.size()), pair.T_base_gripper});
    list.in_order = true;
    list.guess = path + ": its samples are taken to be in the order of the pictures";
  } else if (extension != ".tum" && !is_tum(path)) {
    if (!has_header(path)) return load_bare_poses(path);
    list = load_csv(path);
  } else {
    const data::Trajectory trajectory = data::load_tum(path);
    for (std::size_t i = 0; i < trajectory.times.size(); ++i)
      list.poses.push_back({"", trajectory.times[i], trajectory.poses[i]});
  }
  expect_plausible(list.poses, path);
  return list;
}

PoseList load_joint_list(const std::string& path, const SerialChain& robot) {
  constexpr double kTurns = 4 * M_PI;  // beyond which no joint turns
  std::vector<std::string> names;
  const auto check = [&](const Columns& columns) { names = joint_columns(columns, robot, path); };
  const auto read = [&](const CsvLine& line) {
    RecordedPose pose;
    read_picture(line, pose);
    pose.joints.resize(static_cast<Eigen::Index>(names.size()));
    for (std::size_t k = 0; k < names.size(); ++k) {
      const bool degrees = names[k].ends_with("_deg");
      const double value = line.value(names[k]) * (degrees ? M_PI / 180 : 1);
      if (std::abs(value) > kTurns)
        throw input_error(path, "line " + std::to_string(line.number) + ", " + names[k],
                          "found " + data::format_short(value) +
                              " rad, more than two turns (degrees? end the name in _deg)");
      pose.joints[static_cast<Eigen::Index>(k)] = value;
    }
    pose.pose = gripper_pose(robot, pose.joints);
    return pose;
  };
  return read_csv(path, check, read);
}

RecordedPose load_pose_yaml(const std::string& path) {
  RecordedPose pose;
  const std::optional<long> stamp = number_in_name(path);
  if (!stamp) throw InputError(path + ": found no number in the file name, expected that of its image");
  pose.stamp = static_cast<double>(*stamp);
  YAML::Node file = load_yaml(path);
  if (file.IsMap() && file.size() == 1 && !file.begin()->second.IsScalar()) file = file.begin()->second;
  for (const char* name : {"pose", "transform"})  // of ROS's stamped messages
    if (file.IsMap() && file[name]) file = file[name];
  if (file.IsMap() && file["qw"]) {
    pose.pose = pose_of(xyz(file, path, "pose"),
                        {yaml_number(file["qx"], path, "qx"), yaml_number(file["qy"], path, "qy"),
                         yaml_number(file["qz"], path, "qz"), yaml_number(file["qw"], path, "qw")},
                        path, "pose");
  } else if (file.IsMap() && file["data"]) {
    pose.pose = pose_of_numbers(yaml_numbers(file["data"], path, "data"), path, "data");
  } else if (file.IsMap()) {
    pose.pose = named_pose(file, path, "pose");
  } else {
    pose.pose = pose_of_numbers(yaml_numbers(file, path, "pose"), path, "pose");
  }
  expect_metres({pose.pose.translation().stableNorm()}, path);
  return pose;
}

std::vector<PosePair> load_pose_pairs(const std::string& path) {
  const std::vector<PosePair> pairs =
      data::lower_extension(path) == ".json" ? load_json_pairs(path) : load_samples(path);
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

}  // namespace flash::calib
