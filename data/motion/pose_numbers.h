#pragma once
#include <Eigen/Geometry>
#include <string>
#include <string_view>
#include <vector>

namespace flash::data {

/// Of a quaternion x y z w. Throws InputError, as all here, naming file and place: not of length 1.
Eigen::Isometry3d pose_of(const Eigen::Vector3d& translation, const Eigen::Vector4d& xyzw,
                          const std::string& path, const std::string& where);

/// A rotation and a translation, to 1e-3; the last row 0 0 0 1.
Eigen::Isometry3d pose_of(const Eigen::Matrix4d& matrix, const std::string& path, const std::string& where);

/// 16 (4 x 4, row by row), 12 (3 x 4), 7 (x y z qx qy qz qw) or 6 numbers (x y z, axis times angle).
Eigen::Isometry3d pose_of_numbers(const std::vector<double>& values, const std::string& path,
                                  const std::string& where);

/// Without blanks, quotes and the mark of a comment before it.
std::string trimmed(std::string_view text);

/// The text of a file, without the byte order mark that spreadsheets put before it.
std::string read_text(const std::string& path);

/// A time as files write it, in seconds or, beyond 10^14, in nanoseconds [s].
double seconds_of(double stamp);

/// No arm reaches 10 m: half of the distances beyond that are in another unit.
bool beyond_reach(std::vector<double> distances);
void expect_metres(const std::vector<double>& distances, const std::string& path);

}  // namespace flash::data
