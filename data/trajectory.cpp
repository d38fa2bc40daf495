#include "data/trajectory.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "data/atomic_file.h"
#include "data/error.h"
#include "data/text.h"

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

void append(Trajectory& trajectory, const PoseRow& row, const std::string& path, int line) {
  if (!trajectory.times.empty() && row[0] <= trajectory.times.back())
    throw input_error(path, line_name(line),
                      "time " + format_number(row[0]) + " s follows " +
                          format_number(trajectory.times.back()) + " s, expected strictly increasing times");
  Eigen::Matrix<double, 7, 1> pose;
  std::copy(row.begin() + 1, row.end(), pose.data());
  const double norm = pose.tail<4>().norm();
  if (std::abs(norm - 1) > 1e-3)
    throw input_error(path, line_name(line),
                      "quaternion has length " + format_short(norm) + ", expected 1 (order qx qy qz qw)");
  trajectory.times.push_back(row[0]);
  trajectory.poses.push_back(from_vector(pose));
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
  LineReader lines(text);
  for (std::string_view line; lines.next(line);) {
    const std::vector<std::string_view> words = split(line);
    if (words.empty() || words[0].front() == '#') continue;
    if (words.size() != 8)
      throw input_error(
          path, line_name(lines.number()),
          "found " + std::to_string(words.size()) + " values, expected 8: t tx ty tz qx qy qz qw");
    PoseRow row;
    for (std::size_t c = 0; c < 8; ++c) row[c] = parse_value(words[c], kColumns[c], path, lines.number());
    append(trajectory, row, path, lines.number());
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

Trajectory load_trajectory_csv(const std::string& path) {
  const std::string text = read_file(path);
  Trajectory trajectory;
  LineReader lines(text);
  std::array<std::size_t, 8> column_of{};
  std::size_t columns = 0;
  std::string_view separator;
  for (std::string_view line; lines.next(line);) {
    if (line.empty() || line.front() == '#') continue;
    if (columns == 0) {
      separator = line.find(';') == std::string_view::npos ? "," : ";";
      std::vector<std::string_view> names = split(line, separator);
      columns = names.size();
      for (std::string_view& name : names) {
        const std::vector<std::string_view> trimmed = split(name);
        name = trimmed.empty() ? std::string_view() : trimmed[0];
      }
      for (std::size_t c = 0; c < 8; ++c) {
        const auto found = std::find(names.begin(), names.end(), kColumns[c]);
        if (found == names.end())
          throw input_error(
              path, "header",
              "column \"" + std::string(kColumns[c]) + "\" is missing, expected t,tx,ty,tz,qx,qy,qz,qw");
        column_of[c] = static_cast<std::size_t>(found - names.begin());
      }
      continue;
    }
    const std::vector<std::string_view> cells = split(line, separator);
    if (cells.size() != columns)
      throw input_error(
          path, line_name(lines.number()),
          "found " + std::to_string(cells.size()) + " columns, expected " + std::to_string(columns));
    PoseRow row;
    for (std::size_t c = 0; c < 8; ++c) {
      const std::vector<std::string_view> trimmed = split(cells[column_of[c]]);
      row[c] =
          parse_value(trimmed.empty() ? std::string_view() : trimmed[0], kColumns[c], path, lines.number());
    }
    append(trajectory, row, path, lines.number());
  }
  expect_poses(trajectory, path);
  return trajectory;
}

Trajectory load_trajectory(const std::string& path) {
  return lower_extension(path) == ".csv" ? load_trajectory_csv(path) : load_tum(path);
}

}  // namespace flash::data
