#pragma once
#include <vector>

#include "calib/calibrate/method_comparison.h"

namespace flash::calib {

/// OpenCV's closed forms, for comparison, never for the answer: tsai, park, horaud, andreff, daniilidis of
/// calibrateHandEye (Z: mean of G X C) and shah, li of calibrateRobotWorldHandEye. Tsai, Horaud and
/// Daniilidis of OpenCV 4.6 are far off at times.
std::vector<ClosedForm> opencv_closed_forms();

}  // namespace flash::calib
