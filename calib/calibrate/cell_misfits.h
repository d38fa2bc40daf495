#pragma once
#include <string>
#include <vector>

#include "calib/calibrate/cell.h"

namespace flash::calib {

/// As two recordings write one pose: to a tenth of a millimetre and of a milliradian.
bool same_pose(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b);

/// Whose fault it is that views do not fit, a sentence for each arm or camera that names its pictures. A pose
/// that more cameras leave out than use, two at least, is the robot's. One that others use is that camera's:
/// its picture shows another pose. Where no other camera saw the pose, it is either.
std::vector<std::string> misfit_sentences(const std::vector<CellMember>& members);

/// The members without the views of poses that are the robot's fault, in those too that took them.
std::vector<CellMember> without_wrong_poses(std::vector<CellMember> members);

}  // namespace flash::calib
