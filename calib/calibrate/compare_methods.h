#pragma once
#include <optional>
#include <vector>

#include "calib/calibrate/calibrate.h"
#include "calib/uncertainty/pixel_fit.h"

namespace flash::calib {

/// Fills `result` with every method and its held-out residuals, the answer last: errors in variables, or
/// `pixels` where it predicts views left out better. For two arms each has its halves as well; they hold size
/// and warp of the one print that they show. plain: the fewest pixels with an exact robot; settings: those
/// that errors in variables was made with.
void compare_methods(Calibration& result, const std::vector<Observation>& observations, const Bundle& plain,
                     const std::optional<PixelFit>& pixels, RefineSettings settings,
                     const CalibrateSettings& calibrate);

}  // namespace flash::calib
