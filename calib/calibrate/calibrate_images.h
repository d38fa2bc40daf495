#pragma once
#include <optional>
#include <string>
#include <vector>

#include "calib/calibrate/calibrate.h"
#include "calib/calibrate/cell.h"
#include "calib/dataset/dataset.h"
#include "calib/dataset/target.h"
#include "calib/detect/detect.h"
#include "calib/detect/read_depth.h"
#include "calib/solve/time_offset.h"

namespace flash::calib {

/// Numberings that a detector may have confused: those of plain grids; markers say who they are.
std::vector<Symmetry> confusable_symmetries(const Target& target);

struct ImageCalibration {
  Calibration calibration;                     ///< a view for each picture of the dataset
  std::string refiner;                         ///< of the corners
  std::optional<DepthUse> depth = {};          ///< where the dataset has depth pictures
  std::optional<TimeOffset> time_offset = {};  ///< where it was asked for (Unknowns::time_offsets)
};

/// calibrate() on what was detected. Refiners whose corners fit alike, within 5 %, are told apart by the
/// held-out residual of the robot's chain. Depth pictures take part where they agree with the corners on how
/// far away the target is. With a time offset among the unknowns the poses are taken anew from the stream
/// until nothing is left to shift. Throws data::InputError as calibrate() does; where depth is of another
/// scale altogether; where a time offset is asked for without a stream, or of a robot that stands still.
ImageCalibration calibrate_images(Setup setup, const Dataset& dataset, const Target& target,
                                  const std::vector<Detection>& detections, CalibrateSettings settings = {});

/// The views in use as a member of a cell.
CellMember cell_member(const std::string& arm, const std::string& camera, const Dataset& dataset,
                       const Target& target, const Calibration& calibration);

}  // namespace flash::calib
