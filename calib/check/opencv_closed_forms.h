#pragma once
#include <string>
#include <vector>

#include "calib/geometry/closed_form.h"

namespace flash::calib {

/// A closed form of OpenCV's and how it closes; for comparison, never for the answer.
struct ReferenceMethod {
  std::string name;
  HandEyePoses poses;
  ClosingError relative;  ///< rms of A X = X B over all pairs of views
  bool wild =
      false;  ///< not finite, or far worse than the best: Tsai, Horaud and Daniilidis of OpenCV 4.6 at times
};

/// tsai, park, horaud, andreff, daniilidis of calibrateHandEye (Z: mean of G X C) and shah, li of
/// calibrateRobotWorldHandEye.
std::vector<ReferenceMethod> reference_methods(const std::vector<PoseLoop>& loops);

}  // namespace flash::calib
