#include "data/gravity.h"

#include "data/json_reader.h"
#include "data/text.h"

namespace flash::data {

void check_gravity(const JsonObject& file, const Eigen::Vector3d& gravity) {
  constexpr double kMost = 1000;  // [m/s^2]
  if (!(gravity.norm() <= kMost))
    throw file.error("gravity", "metres a second squared, at most " + format_short(kMost));
}

}  // namespace flash::data
