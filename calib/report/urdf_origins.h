#pragma once
#include <string>
#include <vector>

#include "calib/geometry/arm_model.h"

namespace flash::calib {

/// A URDF with the origins of joints as corrected; nothing else of the text changes, and a second call
/// changes nothing. `path` is for messages. origins: of a chain, from its base on. Throws data::InputError
/// where the text is no XML of a robot, a joint is not there once, is of another kind, axis or parent, or its
/// origin is neither as described nor as corrected: such a file is of another robot, or holds another
/// calibration.
std::string with_joint_origins(const std::string& text, const std::string& path,
                               const std::vector<JointOrigin>& origins);

}  // namespace flash::calib
