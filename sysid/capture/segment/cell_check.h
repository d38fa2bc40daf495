#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sysid/capture/segment/segment.h"

namespace flash::sysid {

/// What cameras see at one time, and where the gripper is then.
struct CellFrame {
  data::Points points;                  ///< of all cameras, base frame [m]
  std::optional<Eigen::Vector3d> tool;  ///< tool centre point, base frame [m]; empty without a gripper
};

/// Why cameras, table and gripper cannot be of one cell, for people to read; empty where they can:
///
/// - a camera is below the table that it sees;
/// - the gripper goes below the table;
/// - the gripper, off the table, is far from all that is seen in most frames, though cloth hangs on it.
///
/// `cameras`: where they are, base frame [m]. Limits are what a registration is off at most in a cell that
/// can be used, some centimetres, and more.
std::string cell_fault(const std::vector<CellFrame>& frames, const std::optional<TablePlane>& table,
                       const std::vector<Eigen::Vector3d>& cameras, const SegmentSettings& settings);

/// Cells of 5 cm above the table that at least three quarters of the frames show: a wall, a shelf, or cloth
/// that is not moved. Frames between which the gripper moved by less than 3 cm count as one. Empty where
/// there are fewer than four.
std::set<StillCell> still_cells(const std::vector<CellFrame>& frames, const std::optional<TablePlane>& table,
                                const SegmentSettings& settings);

}  // namespace flash::sysid
