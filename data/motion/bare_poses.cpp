#include "data/motion/bare_poses.h"

#include <algorithm>
#include <cmath>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "data/motion/pose_numbers.h"
#include "data/motion/rotation_angles.h"

namespace flash::data {
namespace {

using Row = std::vector<double>;

constexpr double kTurn = 2 * M_PI + 1e-6;

std::vector<Row> read_rows(const std::string& path) {
  const std::string text = read_text(path);
  std::vector<Row> rows;
  LineReader lines(text);
  for (std::string_view line; lines.next(line);) {
    const std::vector<std::string_view> words = split(line, " \t\r,;[]()");
    Row row;
    for (const std::string_view word : words) {
      if (word.empty()) continue;
      if (word.front() == '#') break;
      const std::optional<double> value = parse_number(word);
      if (!value || !std::isfinite(*value))
        throw input_error(path, "line " + std::to_string(lines.number()),
                          "found \"" + std::string(word) +
                              "\", expected numbers alone, or a header that names the columns");
      row.push_back(*value);
    }
    if (!row.empty()) rows.push_back(std::move(row));
  }
  if (rows.empty()) throw InputError(path + ": found no poses");
  return rows;
}

/// Matrices over four lines each as one row.
std::vector<Row> joined(std::vector<Row> rows, const std::string& path) {
  if (rows.front().size() != 4) return rows;
  if (rows.size() % 4 != 0)
    throw InputError(path + ": found " + std::to_string(rows.size()) +
                     " lines of four numbers, expected four for each 4 x 4 matrix");
  std::vector<Row> whole;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (i % 4 == 0) whole.emplace_back();
    whole.back().insert(whole.back().end(), rows[i].begin(), rows[i].end());
  }
  return whole;
}

/// Whether rows are 4 x 4 matrices side by side: the last of four lines is 0 0 0 1 again and again, and the
/// first three hold columns of length one.
bool are_side_by_side(const std::vector<Row>& rows) {
  if (rows.size() != 4) return false;
  const std::size_t width = rows.front().size();
  for (const Row& row : rows)
    if (row.size() != width) return false;
  if (width < 8 || width % 4 != 0) return false;
  for (std::size_t column = 0; column < width; ++column) {
    const bool last = column % 4 == 3;
    double squares = 0;
    for (std::size_t i = 0; i < 3; ++i) squares += rows[i][column] * rows[i][column];
    if (rows[3][column] != (last ? 1 : 0) || (!last && !(std::abs(std::sqrt(squares) - 1) < 0.1)))
      return false;
  }
  return true;
}

/// Each of those matrices as one row.
std::vector<Row> parted(const std::vector<Row>& rows) {
  std::vector<Row> whole;
  for (std::size_t first = 0; first < rows.front().size(); first += 4) {
    whole.emplace_back();
    for (const Row& row : rows)
      whole.back().insert(whole.back().end(), row.begin() + static_cast<std::ptrdiff_t>(first),
                          row.begin() + static_cast<std::ptrdiff_t>(first + 4));
  }
  return whole;
}

bool are_quaternions(const std::vector<Row>& rows, std::size_t first) {
  return std::all_of(rows.begin(), rows.end(), [first](const Row& row) {
    double squares = 0;
    for (std::size_t i = first; i < first + 4; ++i) squares += row[i] * row[i];
    return std::abs(std::sqrt(squares) - 1) < 1e-3;
  });
}

/// Whether the first column numbers the rows.
bool are_whole(const std::vector<Row>& rows) {
  return std::all_of(rows.begin(), rows.end(), [](const Row& row) { return row[0] == std::floor(row[0]); });
}

/// Whether the first column may be a number or a time.
bool are_increasing(const std::vector<Row>& rows) {
  for (std::size_t i = 1; i < rows.size(); ++i)
    if (!(rows[i][0] > rows[i - 1][0])) return false;
  return rows.size() > 1;
}

/// stamps: of the rows, where their files are numbered; else empty.
PoseList interpreted(const std::vector<Row>& rows, const std::vector<double>& stamps,
                     const std::string& path) {
  const std::size_t width = rows.front().size();
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (rows[i].size() != width)
      throw input_error(path, "pose " + std::to_string(i + 1),
                        "found " + std::to_string(rows[i].size()) + " numbers, expected " +
                            std::to_string(width) + " as in the first");
  const bool ambiguous = width == 7 && !are_quaternions(rows, 3);
  const bool numbered = stamps.empty() &&
                        (width == 8 || width == 13 || width == 17 || (ambiguous && are_whole(rows))) &&
                        are_increasing(rows);
  const std::size_t first = numbered ? 1 : 0, numbers = width - first;
  if (numbers != 6 && numbers != 7 && numbers != 12 && numbers != 16)
    throw input_error(path, "pose 1",
                      "found " + std::to_string(width) +
                          " numbers, expected 6 (x y z and three angles), 7 (x y z qx qy qz qw), 12 or 16 (a "
                          "matrix), with or without the number of the picture before them");
  PoseList list;
  list.in_order = !numbered && stamps.empty();
  constexpr double kLargestNumber = 1e8;  // no recording has as many pictures: it is a clock
  list.timed = numbered && !(are_whole(rows) && rows.back()[0] < kLargestNumber);
  bool degrees = false;
  for (const Row& row : rows)
    for (std::size_t i = first + 3; numbers == 6 && i < row.size(); ++i) degrees |= std::abs(row[i]) > kTurn;
  std::vector<double> distances;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string where = "pose " + std::to_string(i + 1);
    RecordedPose& pose = list.poses.emplace_back();
    pose.stamp = numbered ? seconds_of(rows[i][0]) : stamps.empty() ? static_cast<double>(i) : stamps[i];
    const Row row(rows[i].begin() + static_cast<std::ptrdiff_t>(first), rows[i].end());
    if (numbers == 6) {
      pose.angles = Eigen::Vector3d(row[3], row[4], row[5]) * (degrees ? M_PI / 180 : 1);
      pose.pose.linear() = rotation_from_angles(*pose.angles);
      pose.pose.translation() << row[0], row[1], row[2];
    } else {
      pose.pose = pose_of_numbers(row, path, where);
    }
    distances.push_back(pose.pose.translation().stableNorm());
  }
  const bool millimetres = beyond_reach(distances);
  if (millimetres)
    for (RecordedPose& pose : list.poses) pose.pose.translation() *= 1e-3;
  const std::string unit = millimetres ? "mm" : "m";
  list.guess = path + ": columns without names were read as " +
               (list.timed ? "a time, "
                : numbered ? "the picture's number, "
                           : "") +
               (numbers == 6 ? "x y z [" + unit + "], three angles [" + (degrees ? "deg" : "rad") +
                                   "] as --angles says (else about fixed x, y, z)"
                : numbers == 7 ? "x y z [" + unit + "], quaternion x y z w"
                               : "a matrix, row by row [" + unit + "]") +
               (list.in_order ? "; poses are in the order of the pictures" : "");
  return list;
}

}  // namespace

PoseList load_bare_poses(const std::string& path) {
  const std::vector<Row> rows = read_rows(path);
  if (!are_side_by_side(rows)) return interpreted(joined(rows, path), {}, path);
  PoseList list = interpreted(parted(rows), {}, path);
  list.guess += "; they stand as 4 x 4 matrices side by side";
  return list;
}

PoseList load_bare_pose_files(const std::vector<std::string>& files, const std::string& folder) {
  std::vector<Row> rows;
  std::vector<double> stamps;
  for (const std::string& file : files) {
    Row row;  // a matrix may stand on three or four lines
    for (const Row& line : read_rows(file)) row.insert(row.end(), line.begin(), line.end());
    const std::optional<long> number = number_in_name(file);
    if (!number) throw InputError(file + ": found no number in the file name, expected that of its image");
    rows.push_back(std::move(row));
    stamps.push_back(static_cast<double>(*number));
  }
  return interpreted(rows, stamps, folder);
}

}  // namespace flash::data
