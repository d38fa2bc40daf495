#pragma once
#include <Eigen/Core>

namespace flash::data {

class JsonObject;

/// Throws InputError where `gravity` of the file is more than a hundred times that of the Earth: units were
/// mistaken, and no step of a simulation could follow.
void check_gravity(const JsonObject& file, const Eigen::Vector3d& gravity);

}  // namespace flash::data
