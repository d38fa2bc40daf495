#pragma once
#include <string>
#include <vector>

#include "calib/dataset/dataset.h"
#include "calib/dataset/detection.h"
#include "calib/dataset/target.h"

namespace flash::calib {

/// Whether the lens is what keeps the pictures from fitting: corners that a homography fits, as it fits a
/// flat target behind any lens, and that no pose fits through the dataset's. A sentence that names its file
/// and numbers; empty where the lens explains the usual view, or where the views have too few corners to
/// tell.
std::string lens_doubt(const Dataset& dataset, const Target& target,
                       const std::vector<Detection>& detections);

}  // namespace flash::calib
