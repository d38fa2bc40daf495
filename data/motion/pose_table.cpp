#include "data/motion/pose_table.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>

#include "data/files/error.h"
#include "data/files/text.h"
#include "data/motion/pose_numbers.h"
#include "data/motion/rotation_angles.h"

namespace flash::data {
namespace {

bool names_pictures(const Columns& columns) {
  return columns.count("image") + columns.count("index") + columns.count("t") > 0;
}

RecordedPose pose_of_line(const PoseTableLine& line) {
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
    const bool kuka = line.has("a");
    if (line.has("rotvec_x")) {
      rotation = rotation_from_vector(line.vector({"rotvec_x", "rotvec_y", "rotvec_z"}));
    } else {
      const bool degrees = kuka || line.has("rx_deg");
      pose.angles =
          (kuka ? line.vector({"a", "b", "c"}) : line.vector({"rx", "ry", "rz"}, degrees ? "_deg" : "")) *
          (degrees ? M_PI / 180 : 1);
      if (!degrees && pose.angles->cwiseAbs().maxCoeff() > 2 * M_PI + 1e-6)
        throw input_error(line.path, where,
                          "angle of " + format_short(pose.angles->cwiseAbs().maxCoeff()) +
                              " rad is beyond a full turn (degrees? name the columns rx_deg ry_deg rz_deg)");
      rotation = rotation_from_angles(*pose.angles, kuka ? "ZYX" : "xyz");
    }
    pose.pose.linear() = rotation;
    pose.pose.translation() = translation;
  }
  read_picture(line, pose);
  return pose;
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
      !all({"rotvec_x", "rotvec_y", "rotvec_z"}) && !all({"a", "b", "c"}))
    throw input_error(path, "header",
                      "found " + names_in(columns) +
                          ", and with them no rotation, expected qx,qy,qz,qw or rx,ry,rz or "
                          "rotvec_x,rotvec_y,rotvec_z");
}

}  // namespace

bool PoseTableLine::has(const std::string& column) const { return columns.count(column) > 0; }

const std::string& PoseTableLine::text(const std::string& column) const { return cells[columns.at(column)]; }

double PoseTableLine::value(const std::string& column) const {
  const std::optional<double> found = parse_number(text(column));
  if (!found || !std::isfinite(*found))
    throw input_error(path, "line " + std::to_string(number) + ", " + column,
                      "found \"" + text(column) + "\", expected a finite number");
  return *found;
}

Eigen::Vector3d PoseTableLine::vector(const std::array<const char*, 3>& names,
                                      const std::string& ending) const {
  return {value(names[0] + ending), value(names[1] + ending), value(names[2] + ending)};
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
                                                             {"roll", "rx"},
                                                             {"pitch", "ry"},
                                                             {"yaw", "rz"},
                                                             {"roll_deg", "rx_deg"},
                                                             {"pitch_deg", "ry_deg"},
                                                             {"yaw_deg", "rz_deg"}};
  const auto found = aliases.find(name);
  return found == aliases.end() ? name : found->second;
}

/// To which picture the line belongs; without a column that says so, to that of its place.
void read_picture(const PoseTableLine& line, RecordedPose& pose) {
  if (!names_pictures(line.columns)) return;
  if (line.has("image"))
    pose.image = line.text("image");
  else
    pose.stamp = line.value(line.has("index") ? "index" : "t");
  pose.stamp = seconds_of(pose.stamp);  // EuRoC counts nanoseconds
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

PoseList read_pose_table(const std::string& path, const std::function<void(const Columns&)>& check,
                         const std::function<RecordedPose(const PoseTableLine&)>& read) {
  const std::string text = read_text(path);
  PoseList list;
  Columns columns;
  const char* separator = ",";
  LineReader lines(text);
  for (std::string_view line; lines.next(line);) {
    if (trimmed(line).empty() || (!columns.empty() && line.front() == '#')) continue;
    if (line.front() == '#' && line.find_first_of(",;") == std::string_view::npos) continue;  // not a header
    if (columns.empty() && line.find(';') != std::string_view::npos) separator = ";";
    std::vector<std::string> cells;
    for (const std::string_view cell : split(line, separator)) cells.push_back(trimmed(cell));
    if (columns.empty()) {
      for (std::size_t c = 0; c < cells.size(); ++c)
        if (const auto [first, is_new] = columns.emplace(column_name(cells[c]), c);
            !is_new && !cells[c].empty())
          throw input_error(path, "header",
                            "found " + first->first + " as column " + std::to_string(first->second + 1) +
                                " and as column " + std::to_string(c + 1) + ", expected it once");
      check(columns);
      continue;
    }
    if (cells.size() < columns.size())
      throw input_error(
          path, "line " + std::to_string(lines.number()),
          "found " + std::to_string(cells.size()) + " columns, expected " + std::to_string(columns.size()));
    list.poses.push_back(read(PoseTableLine{path, columns, std::move(cells), lines.number()}));
    if (!names_pictures(columns)) list.poses.back().stamp = static_cast<double>(list.poses.size() - 1);
  }
  if (list.poses.empty()) throw InputError(path + ": found no poses below its header");
  list.in_order = !names_pictures(columns);
  list.timed = columns.count("t") > 0 && columns.count("image") + columns.count("index") == 0;
  if (list.in_order)
    list.guess =
        path + ": no column image, index or t; its lines are taken to be in the order of the pictures";
  return list;
}

PoseList load_pose_table(const std::string& path) {
  return read_pose_table(
      path, [&](const Columns& columns) { expect_columns(columns, path); }, pose_of_line);
}

}  // namespace flash::data
