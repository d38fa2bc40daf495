#include "calib/check/same_place.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdio>

#include "calib/check/chance.h"
#include "data/files/error.h"

namespace flash::calib {

Placement placement(const Extrinsics& first, const Extrinsics& second, const std::string& first_name,
                    const std::string& second_name) {
  if (first.setup != second.setup)
    throw data::InputError(second_name + ": found " + to_string(second.setup) + ", expected " +
                           to_string(first.setup) + " as in " + first_name);
  if (first.transform.parent != second.transform.parent || first.transform.child != second.transform.child)
    throw data::InputError(second_name + ": found " + second.transform.parent + " <- " +
                           second.transform.child + ", expected " + first.transform.parent + " <- " +
                           first.transform.child + " as in " + first_name);
  Placement result;
  result.apart = motion_between(first.transform.T, second.transform.T);
  const Eigen::LDLT<Matrix6d> both(first.covariance + second.covariance);
  if (both.info() != Eigen::Success || !(both.vectorD().minCoeff() > 0))
    throw data::InputError(second_name + ": found no covariance, nor in " + first_name +
                           ", expected how well each of them is known");
  result.chi_square = result.apart.dot(both.solve(result.apart));
  result.chance = chance_beyond(result.chi_square, 6);
  constexpr double kMoved = 0.01;
  result.moved = result.chance < kMoved;
  return result;
}

std::string describe(const Placement& placement) {
  char text[240];
  std::snprintf(
      text, sizeof text,
      "%s: the two put the camera %.2f mm and %.3f deg apart; one that stands still would be put farther "
      "apart with a chance of %s",
      placement.moved ? "moved" : "same", 1e3 * placement.apart.head<3>().norm(),
      placement.apart.tail<3>().norm() * 180 / M_PI, chance_text(placement.chance).c_str());
  return text;
}

}  // namespace flash::calib
