#pragma once
#include <vector>

#include "calib/solve/errors_in_variables.h"

namespace flash::calib {

/// What is done about the size of a printed target. Printers, and measuring across a whole sheet, are off by
/// tenths of a percent to two percent; that moves the camera by as much of its distance.
enum class TargetSize {
  stated,     ///< as it is stated
  solved,     ///< one more unknown
  automatic,  ///< solved where the data say clearly that it is off, and by little; otherwise as stated
};

struct ScaleCheck {
  double estimate = 1;  ///< true size of the target over the size stated
  double sd = 0;
  bool solved = false;  ///< the answer is for this size, not for the stated one
};

/// Off by more than three standard deviations, and by no more than 3 %: what is further off is not a print.
bool clearly_off(const ScaleCheck& scale);

/// The size of every target as one more unknown, one solution for all. None where the data do not tell them,
/// as those of a robot that turns and never moves along, without depth.
std::vector<ScaleCheck> check_scales(const Refinement& refined, const RefineSettings& settings);

}  // namespace flash::calib
