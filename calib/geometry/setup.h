#pragma once
#include <string>

namespace flash::calib {

enum class Setup {
  eye_in_hand,  ///< the camera rides on the gripper, the target stands still: X = T_gripper_camera, Z =
                ///< T_base_target
  eye_to_hand   ///< the camera stands still, the gripper holds the target: X = T_base_camera, Z =
                ///< T_gripper_target
};

const char* to_string(Setup setup);      ///< "eye-in-hand", "eye-to-hand"
const char* camera_parent(Setup setup);  ///< the frame of X where nobody names it: "gripper", "base"
/// Throws data::InputError naming `source` and `field`.
Setup parse_setup(const std::string& text, const std::string& source, const std::string& field);

}  // namespace flash::calib
