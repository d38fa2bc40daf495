#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "data/motion/pose_file.h"

namespace flash::data {

/// The names of a CSV's columns as we call them, and their places.
using Columns = std::map<std::string, std::size_t>;

/// The name of a column as we call it: EuRoC and others say it in more words.
std::string column_name(const std::string& header);

/// The cells of a line, by the names of its columns.
struct PoseTableLine {
  const std::string& path;
  const Columns& columns;
  std::vector<std::string> cells;
  int number;

  bool has(const std::string& column) const;
  const std::string& text(const std::string& column) const;
  double value(const std::string& column) const;  ///< throws InputError unless it is a finite number
  Eigen::Vector3d vector(const std::array<const char*, 3>& names, const std::string& ending = "") const;
};

/// To which picture or time the line belongs: its column image, index or t; nothing where it has none.
void read_picture(const PoseTableLine& line, RecordedPose& pose);

/// A CSV below a header, parted by commas or semicolons. `check` looks at its columns, `read` makes a pose of
/// each line. Throws InputError naming file and line.
PoseList read_pose_table(const std::string& path, const std::function<void(const Columns&)>& check,
                         const std::function<RecordedPose(const PoseTableLine&)>& read);

/// The same of tx ty tz and a rotation, as load_pose_list says.
PoseList load_pose_table(const std::string& path);

/// "t, tx, ty", in the order of the file.
std::string names_in(const Columns& columns);

}  // namespace flash::data
