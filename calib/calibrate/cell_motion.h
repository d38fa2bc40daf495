#pragma once
#include <Eigen/Geometry>
#include <functional>
#include <string>
#include <vector>

#include "calib/calibrate/cell.h"

namespace flash::calib {

/// A recording of a cell, solved by itself.
struct CellRecording {
  Calibration calibration;
  CellMember member;
  std::vector<Eigen::Isometry3d> T_base_gripper;  ///< of each view, as the robot reported it
  std::vector<double> stamps;                     ///< of each view
  /// The same with other robot poses, of each view in order. Throws data::InputError.
  std::function<Calibration(const std::vector<Eigen::Isometry3d>& T_base_gripper)> solve;
};

/// All cameras that see one arm speak to one hypothesis. A camera by itself may take an error of the robot
/// for a motion of the target or of its own. Where others that saw most of its poses tell of none, it is
/// solved again with the robot's poses as they see them: a motion that is then gone was the robot's, and the
/// recording counts with all of its views. One that stays took place. Returns a sentence for each that is
/// gone.
std::vector<std::string> settle_motions(std::vector<CellRecording>& recordings);

}  // namespace flash::calib
