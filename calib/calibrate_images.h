#pragma once
#include <string>
#include <vector>

#include "calib/calibrate.h"
#include "calib/dataset.h"
#include "calib/detect.h"
#include "calib/register.h"
#include "calib/target.h"

namespace flash::calib {

/// Numberings that a detector may have confused: those of plain grids; markers say who they are.
std::vector<Symmetry> confusable_symmetries(const Target& target);

struct ImageCalibration {
  Calibration calibration;  ///< a view for each picture of the dataset
  std::string refiner;      ///< of the corners
};

/// calibrate() on what was detected. Refiners whose corners fit alike, within 5 %, are told apart by the
/// held-out residual of the robot's chain.
ImageCalibration calibrate_images(Setup setup, const Dataset& dataset, const Target& target,
                                  const std::vector<Detection>& detections, CalibrateSettings settings = {});

/// The views in use as a member of a cell.
CellMember cell_member(const std::string& arm, const std::string& camera, const Dataset& dataset,
                       const Target& target, const Calibration& calibration);

}  // namespace flash::calib
