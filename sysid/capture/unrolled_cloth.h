#pragma once
#include <Eigen/Core>
#include <vector>

#include "data/mesh/mesh.h"

namespace flash::sysid {

/// Where the points of raised cloth were on the lying sheet, seen from above from the corner that the gripper
/// at `tool` holds [m]. Cloth that is raised bends about level lines, to a cylinder: along these a way is
/// what it was on the table, and across them about what it is in a straight line from the tool. Level lines
/// are those of the plane that fits the cloud best. Empty where that plane is flatter than 0.3, which tells
/// no direction, and of fewer than 100 points; of many, some 500 count.
std::vector<Eigen::Vector2d> unrolled(const data::Points& cloud, const Eigen::Vector3d& tool);

}  // namespace flash::sysid
