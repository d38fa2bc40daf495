#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "data/recording/recording.h"

namespace flash::sysid {

/// What a search will start from, as SVG text: the sheet as it is assumed to lie, the way of the gripper, the
/// clouds coloured by their time, the table and the cameras, from the side above and from the top below, with
/// scale and legend. `cameras`: base frame [m].
std::string draw_import(const data::Recording& recording, const std::vector<data::Keyframe>& keyframes,
                        const std::vector<Eigen::Vector3d>& cameras);

}  // namespace flash::sysid
