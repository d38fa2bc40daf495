#pragma once
#include <optional>
#include <string>
#include <vector>

#include "calib/calibrate/calibrate.h"
#include "calib/dataset/dataset.h"
#include "calib/dataset/depth_use.h"
#include "calib/dataset/detection.h"
#include "calib/dataset/target.h"
#include "calib/solve/time_offset.h"

namespace flash::calib {

struct ImageCalibration {
  Calibration calibration;                     ///< a view for each picture of the dataset
  std::string refiner;                         ///< of the corners
  std::optional<DepthUse> depth = {};          ///< where the dataset has depth pictures
  std::optional<TimeOffset> time_offset = {};  ///< where it was solved for (CalibrateSettings::clock_offset)
};

/// calibrate() on what was detected. Refiners whose corners fit alike, within 5 %, are told apart by the
/// held-out residual of the robot's chain. depth: of the target, as read_depth() gives it. With a time offset
/// among the unknowns the poses are taken anew from the stream until nothing is left to shift, and corners of
/// views that scatter more than those of others, as in blurred pictures, count less (corner_noise_ratios).
/// Throws data::InputError as calibrate() does, and where a time offset is asked for without a stream, or of
/// a robot that stands still.
ImageCalibration calibrate_images(Setup setup, const Dataset& dataset, const Target& target,
                                  const std::vector<Detection>& detections,
                                  const std::optional<DepthViews>& depth, CalibrateSettings settings = {});

}  // namespace flash::calib
