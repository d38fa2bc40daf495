#pragma once
#include <string>
#include <vector>

#include "calib/solve/errors_in_variables.h"

namespace flash::calib {

/// How the poses of each arm are cut in two.
enum class Split {
  interleaved,  ///< every other pose: shows whether noise alone is stated right
  consecutive,  ///< first and second half: shows drift
  place_1,  ///< at the median along the first, second or third principal axis of the gripper's places: shows
  place_2,  ///< errors that depend on where the robot is, a lens or a kinematic model that is not exact
  place_3
};

/// Two halves of the poses, each solved by itself, and how far apart they put one frame.
struct SplitCheck {
  Split split = Split::interleaved;
  Vector6d apart = Vector6d::Zero();  ///< (dt, dtheta) [m, rad]
  double chi_square = 0;              ///< of it under the stated uncertainty, 6 degrees of freedom
};

/// 0 or 1 for each gripper place of one arm, in the order of its poses [m].
std::vector<int> halves_of(const std::vector<Eigen::Vector3d>& places, Split split);

/// base: of the arm whose base is compared; 0: the first camera.
SplitCheck check_halves(const Refinement& refined, const BundleSettings& settings, Split split,
                        std::size_t base = 0);

/// All splits that can show an error beside noise.
std::vector<SplitCheck> check_systematic(const Refinement& refined, const BundleSettings& settings,
                                         std::size_t base = 0, int threads = 1);

/// By how much a covariance has to grow to be true to halves that should agree: the largest chi-square over
/// its 6 degrees of freedom, where it lies beyond what the best of that many agreeing splits passes once in
/// twenty (Bonferroni, at most five); otherwise 1. `worst` names the split.
double split_inflation(const std::vector<SplitCheck>& checks, const SplitCheck** worst = nullptr);

const char* to_string(Split split);  ///< the names above
/// "first and second half of the views" and the like.
std::string describe(Split split);

}  // namespace flash::calib
