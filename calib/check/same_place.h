#pragma once
#include "calib/calibrate/extrinsics.h"

namespace flash::calib {

/// Where a second recording has the camera, against a first one.
struct Placement {
  Vector6d apart = Vector6d::Zero();  ///< motion of the camera, along and about its own axes [m, rad]
  double chi_square = 0;              ///< of it, by both covariances; six degrees of freedom
  double chance = 1;                  ///< that a camera which stands still would be put farther apart
  bool moved = false;                 ///< the chance is below 1 %
};

/// Both covariances count whole: what errors of one arm have in common makes a camera that stands still look
/// so rather more often than 99 %. Throws data::InputError where the two are of other setups or frames;
/// names: of the files.
Placement placement(const Extrinsics& first, const Extrinsics& second, const std::string& first_name,
                    const std::string& second_name);

/// "moved: ..." or "same: ...".
std::string describe(const Placement& placement);

}  // namespace flash::calib
