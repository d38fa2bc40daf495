#include "data/recording/gravity.h"

#include "data/files/json_reader.h"
#include "data/files/text.h"
#include "data/recording/recording.h"

namespace flash::data {
namespace {

std::string text_of(const Eigen::Vector3d& vector) {
  const Eigen::Vector3d v = vector.array() + 0.0;  // no -0
  return format_short(v.x()) + ", " + format_short(v.y()) + ", " + format_short(v.z());
}

}  // namespace

void check_gravity(const JsonObject& file, const Eigen::Vector3d& gravity) {
  constexpr double kMost = 1000;  // [m/s^2]
  if (!(gravity.norm() <= kMost))
    throw file.error("gravity", "metres a second squared, at most " + format_short(kMost));
}

void judge_gravity(const JsonObject& file, Recording& recording) {
  constexpr double kMost = 100, kLow = 9.5, kHigh = 10;  // [m/s^2]; of the Earth 9.76 to 9.83
  const Eigen::Vector3d& gravity = recording.gravity;
  const double strength = gravity.norm();
  if (strength == 0) return;  // as in a fall; what it says of bending is judged with the answer
  if (!(strength <= kMost))
    throw file.error("gravity", "metres a second squared, as 0, 0, -9.81; at most " + format_short(kMost));
  // A wall is no table; rounding is no slope.
  if (recording.has_table && gravity.dot(recording.table_normal) > 1e-6 * strength)
    throw file.error("gravity", "one that points into the table, whose normal is " +
                                    text_of(recording.table_normal) + ", as " +
                                    text_of(-9.81 * recording.table_normal));
  if (!recording.has_table && gravity.z() > 0.1 * strength)
    recording.doubts.push_back("gravity: found " + text_of(gravity) +
                               ", which points up, expected 0, 0, -9.81 unless the robot's base hangs from a "
                               "ceiling");
  if (strength < kLow || strength > kHigh)
    recording.doubts.push_back("gravity: found " + format_short(strength) +
                               " m/s^2, expected 9.81 on the Earth: every stiffness scales with it");
}

}  // namespace flash::data
