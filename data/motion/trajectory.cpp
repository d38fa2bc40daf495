#include "data/motion/trajectory.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "data/motion/pose_file.h"
#include "data/motion/pose_numbers.h"
#include "data/motion/pose_table.h"

namespace flash::data {
namespace {

using PoseRow = std::array<double, 8>;  // t tx ty tz qx qy qz qw
constexpr std::array<const char*, 8> kColumns = {"t", "tx", "ty", "tz", "qx", "qy", "qz", "qw"};

std::string line_name(int number) { return "line " + std::to_string(number); }

double parse_value(std::string_view word, const char* column, const std::string& path, int line) {
  const std::optional<double> value = parse_number(word);
  if (!value || !std::isfinite(*value))
    throw input_error(path, line_name(line) + ", " + column,
                      "found \"" + std::string(word) + "\", expected a finite number");
  return *value;
}

void append(Trajectory& trajectory, double time, const Eigen::Isometry3d& pose, const std::string& path,
            const std::string& where) {
  if (!trajectory.times.empty() && time <= trajectory.times.back())
    throw input_error(path, where,
                      "time " + format_number(time) + " s follows " + format_number(trajectory.times.back()) +
                          " s, expected strictly increasing times");
  trajectory.times.push_back(time);
  trajectory.poses.push_back(pose);
}

Eigen::Isometry3d pose_of(const PoseRow& row, const std::string& path, int line) {
  Eigen::Matrix<double, 7, 1> pose;
  std::copy(row.begin() + 1, row.end(), pose.data());
  const double norm = pose.tail<4>().norm();
  if (std::abs(norm - 1) > 1e-3)
    throw input_error(path, line_name(line),
                      "quaternion has length " + format_short(norm) + ", expected 1 (order qx qy qz qw)");
  return from_vector(pose);
}

/// The places of t tx ty tz qx qy qz qw in a line where a comment names them in another order, as w before x,
/// y and z.
std::optional<std::array<std::size_t, 8>> named_order(const std::vector<std::string_view>& words) {
  std::vector<std::string> names;
  for (const std::string_view word : words)
    if (const std::string name = column_name(trimmed(word.substr(0, word.find('['))));
        !name.empty() && word.front() != '[')
      names.push_back(name);
  std::array<std::size_t, 8> order{};
  if (names.size() != order.size()) return std::nullopt;
  for (std::size_t c = 0; c < order.size(); ++c) {
    const auto found = std::find(names.begin(), names.end(), kColumns[c]);
    if (found == names.end()) return std::nullopt;
    order[c] = static_cast<std::size_t>(found - names.begin());
  }
  return order;
}

void expect_poses(const Trajectory& trajectory, const std::string& path) {
  if (trajectory.times.empty())
    throw InputError(path + ": found no poses, expected lines t tx ty tz qx qy qz qw");
}

}  // namespace

Eigen::Matrix<double, 7, 1> to_vector(const Eigen::Isometry3d& pose) {
  Eigen::Quaterniond q(pose.linear());
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  Eigen::Matrix<double, 7, 1> row;
  row << pose.translation(), q.coeffs();
  return row;
}

Eigen::Isometry3d from_vector(const Eigen::Matrix<double, 7, 1>& pose) {
  const Eigen::Quaterniond q(pose[6], pose[3], pose[4], pose[5]);
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.linear() = q.normalized().toRotationMatrix();
  result.translation() = pose.head<3>();
  return result;
}

Eigen::Isometry3d pose_between(const Eigen::Isometry3d& before, const Eigen::Isometry3d& after,
                               double share) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = (1 - share) * before.translation() + share * after.translation();
  const Eigen::Quaterniond q =
      Eigen::Quaterniond(before.linear()).slerp(share, Eigen::Quaterniond(after.linear())).normalized();
  pose.linear() = q.toRotationMatrix();
  return pose;
}

Eigen::Isometry3d pose_at(const Trajectory& trajectory, double t) {
  if (trajectory.times.empty()) return Eigen::Isometry3d::Identity();
  const auto after = std::upper_bound(trajectory.times.begin(), trajectory.times.end(), t);
  if (after == trajectory.times.begin()) return trajectory.poses.front();
  if (after == trajectory.times.end()) return trajectory.poses.back();
  const std::size_t i = static_cast<std::size_t>(after - trajectory.times.begin());
  const double s = (t - trajectory.times[i - 1]) / (trajectory.times[i] - trajectory.times[i - 1]);
  return pose_between(trajectory.poses[i - 1], trajectory.poses[i], s);
}

Trajectory load_tum(const std::string& path) {
  const std::string text = read_file(path);
  Trajectory trajectory;
  std::array<std::size_t, 8> order = {0, 1, 2, 3, 4, 5, 6, 7};
  LineReader lines(text);
  for (std::string_view line; lines.next(line);) {
    const std::vector<std::string_view> words = split(line);
    if (words.empty()) continue;
    if (words[0].front() == '#') {
      if (trajectory.times.empty()) order = named_order(words).value_or(order);
      continue;
    }
    if (words.size() != 8)
      throw input_error(
          path, line_name(lines.number()),
          "found " + std::to_string(words.size()) + " values, expected 8: t tx ty tz qx qy qz qw");
    PoseRow row;
    for (std::size_t c = 0; c < 8; ++c)
      row[c] = parse_value(words[order[c]], kColumns[c], path, lines.number());
    append(trajectory, seconds_of(row[0]), pose_of(row, path, lines.number()), path,
           line_name(lines.number()));
  }
  expect_poses(trajectory, path);
  return trajectory;
}

void save_tum(const Trajectory& trajectory, const std::string& path) {
  std::string text = "# t[s] tx ty tz[m] qx qy qz qw\n";
  for (std::size_t i = 0; i < trajectory.times.size(); ++i) {
    text += format_number(trajectory.times[i]);
    for (const double value : to_vector(trajectory.poses[i])) text += ' ' + format_number(value);
    text += '\n';
  }
  write_atomically(path, text);
}

namespace {

Trajectory timed(const PoseList& list, const std::string& path) {
  if (!list.timed)
    throw InputError(path + ": found " + std::to_string(list.poses.size()) +
                     " poses without times, expected a time before each, as t tx ty tz qx qy qz qw");
  Trajectory trajectory;
  for (std::size_t i = 0; i < list.poses.size(); ++i)
    append(trajectory, list.poses[i].stamp, list.poses[i].pose, path, "pose " + std::to_string(i + 1));
  return trajectory;
}

}  // namespace

Trajectory load_trajectory_csv(const std::string& path) { return timed(load_pose_table(path), path); }

Trajectory load_trajectory(const std::string& path) {
  return is_tum(path) ? load_tum(path) : timed(load_pose_list(path), path);
}

}  // namespace flash::data
