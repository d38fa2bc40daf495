#pragma once
#include <optional>
#include <vector>

#include "calib/dataset/dataset.h"
#include "calib/dataset/depth_use.h"
#include "calib/dataset/detection.h"

namespace flash::calib {

/// Reads the depth pictures of all frames that show the target; none where no frame has one. Throws
/// data::InputError where depth and corners differ about its distance by more than a tenth (another unit), or
/// where depth is not registered to the pictures.
std::optional<DepthViews> read_depth(const Dataset& dataset, const std::vector<Detection>& detections);

}  // namespace flash::calib
