#include "data/motion/pose_numbers.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "data/motion/rotation_angles.h"
#include "data/motion/trajectory.h"
#include "data/numbers/median.h"

namespace flash::data {
namespace {

constexpr double kReach = 10;  // [m]

/// Why a matrix is no rotation.
std::string not_a_rotation(const Eigen::Matrix3d& matrix) {
  const Eigen::RowVector3d lengths = matrix.colwise().norm();
  Eigen::Index worst = 0;
  (lengths.array() - 1).abs().maxCoeff(&worst);
  const std::string place = std::to_string(worst);
  if (!(std::abs(lengths[worst] - 1) < 1e-3))
    return "found a matrix that is no rotation: its column " + std::to_string(worst + 1) + " has length " +
           format_short(lengths[worst]) + " (R(" + place + "," + place + ") is " +
           format_short(matrix(worst, worst)) + "), expected 1";
  if (matrix.determinant() < 0) return "found a matrix that mirrors (determinant -1), expected a rotation";
  return "found a matrix that is no rotation: two of its columns have the product " +
         format_short((matrix.transpose() * matrix - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff()) +
         ", expected 0";
}

void expect_finite(const Eigen::Ref<const Eigen::VectorXd>& numbers, const std::string& path,
                   const std::string& where) {
  for (const double number : numbers)
    if (!std::isfinite(number))
      throw input_error(path, where, "found " + format_short(number) + ", expected a number");
}

}  // namespace

Eigen::Isometry3d pose_of(const Eigen::Vector3d& translation, const Eigen::Vector4d& xyzw,
                          const std::string& path, const std::string& where) {
  expect_finite(translation, path, where);
  if (!(std::abs(xyzw.norm() - 1) <= 1e-3))
    throw input_error(path, where,
                      "quaternion has length " + format_short(xyzw.norm()) + ", expected 1 (order x y z w)");
  Eigen::Matrix<double, 7, 1> row;
  row << translation, xyzw;
  return from_vector(row);
}

Eigen::Isometry3d pose_of(const Eigen::Matrix4d& matrix, const std::string& path, const std::string& where) {
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const double off = (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).norm();
  expect_finite(matrix.topRightCorner<3, 1>(), path, where);
  if (!((matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm() <= 1e-6))
    throw input_error(path, where, "expected a rotation and a translation as 4 x 4, last row 0 0 0 1");
  if (!(off < 1e-3) || rotation.determinant() < 0) throw input_error(path, where, not_a_rotation(rotation));
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Quaterniond(rotation).normalized().toRotationMatrix();
  pose.translation() = matrix.topRightCorner<3, 1>();
  return pose;
}

Eigen::Isometry3d pose_of_numbers(const std::vector<double>& values, const std::string& path,
                                  const std::string& where) {
  if (values.size() == 16 || values.size() == 12) {
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    const auto rows = static_cast<Eigen::Index>(values.size() / 4);
    matrix.topRows(rows) =
        Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor>>(values.data(), rows, 4);
    return pose_of(matrix, path, where);
  }
  if (values.size() == 7)
    return pose_of({values[0], values[1], values[2]}, {values[3], values[4], values[5], values[6]}, path,
                   where);
  if (values.size() == 6) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = rotation_from_vector({values[3], values[4], values[5]});
    pose.translation() << values[0], values[1], values[2];
    expect_finite(Eigen::Map<const Eigen::Matrix<double, 6, 1>>(values.data()), path, where);
    return pose;
  }
  throw input_error(path, where,
                    "found " + std::to_string(values.size()) +
                        " numbers, expected a pose: 16 or 12 (matrix), 7 (x y z qx qy qz qw) or 6 (x y "
                        "z and axis times angle)");
}

std::string trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\"#"), end = text.find_last_not_of(" \t\r\"");
  return begin == std::string_view::npos ? std::string() : std::string(text.substr(begin, end + 1 - begin));
}

double seconds_of(double stamp) { return std::abs(stamp) > 1e14 ? stamp * 1e-9 : stamp; }

std::string read_text(const std::string& path) {
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  std::string text = read_file(path);
  if (text.starts_with(kMark)) text.erase(0, kMark.size());
  if (const std::size_t zero = text.find('\0'); zero != std::string::npos)
    throw InputError(path + ": found a byte 0, expected text, at byte " + std::to_string(zero));
  // Lines of old end in a carriage return alone.
  if (text.find('\n') == std::string::npos) std::replace(text.begin(), text.end(), '\r', '\n');
  return text;
}

bool beyond_reach(std::vector<double> distances) {
  return !distances.empty() && median(std::move(distances)) > kReach;
}

void expect_metres(const std::vector<double>& distances, const std::string& path) {
  if (beyond_reach(distances))
    throw input_error(path, "translations",
                      "half of them are beyond " + format_short(median(distances)) +
                          " m, expected metres (are these millimetres? divide by 1,000, or name the columns "
                          "of a table x_mm, y_mm, z_mm)");
}

}  // namespace flash::data
