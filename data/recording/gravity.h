#pragma once
#include <Eigen/Core>

namespace flash::data {

class JsonObject;
struct Recording;

/// Throws InputError where `gravity` of the file is more than a hundred times that of the Earth: units were
/// mistaken, and no step of a simulation could follow.
void check_gravity(const JsonObject& file, const Eigen::Vector3d& gravity);

/// Of a recording whose table is read. Throws InputError where gravity lifts the object off the table, or is
/// more than ten times that of the Earth, as in cm/s^2. Puts into the recording's doubts where it is not that
/// of the Earth, or points up and there is no table that says where up is.
void judge_gravity(const JsonObject& file, Recording& recording);

}  // namespace flash::data
