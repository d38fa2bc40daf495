#pragma once
#include <optional>
#include <string>

#include "calib/solve/held_out.h"

namespace flash::calib {

/// What an answer is for: it decides between what else it is for, where robot, lens and print are not what
/// their models say.
enum class Use {
  workspace,  ///< places seen by the camera, in the robot's frame: errors in variables, lens and print solved
              ///< for
  image,    ///< pictures predicted through this robot: the fewest pixels, where that predicts them better by
            ///< two standard errors
  two_arms  ///< arms that one camera relates: the lens as stated, for all alike
};
const char* to_string(Use use);  ///< "workspace", "image", "two-arms"
std::optional<Use> use_named(const std::string& name);

/// The error of an answer in what it is for.
struct UseError {
  Use use = Use::workspace;
  const char* measure = "";          ///< of views left out, or of halves
  const char* unit = "mm";           ///< of it: mm or px
  std::optional<double> value = {};  ///< none where there are too few views to tell
};
UseError use_error(Use use, const HeldOut& held_out, const std::optional<Halves>& halves);

}  // namespace flash::calib
