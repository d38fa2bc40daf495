#pragma once
#include <string>
#include <vector>

#include "data/motion/pose_file.h"

namespace flash::data {

/// Poses as numbers without a word on what they are, a pose a line (or a 4 x 4 matrix over four lines,
/// or all of them side by side over four lines),
/// parted by commas, semicolons or blanks:
///   16 or 12   a matrix, row by row
///   7          x y z qx qy qz qw
///   6          x y z and three angles, about fixed x, y, z; in degrees where one is beyond a full turn
/// Each may stand behind the number of its picture or a time [s], [ns]. Translations are in millimetres where
/// they are too long for metres. What was taken for what is in PoseList::guess. Throws InputError.
PoseList load_bare_poses(const std::string& path);

/// The same of files with one pose each, which the last number in their names numbers.
PoseList load_bare_pose_files(const std::vector<std::string>& files, const std::string& folder);

}  // namespace flash::data
