#include "calib/geometry/setup.h"

#include "data/files/error.h"

namespace flash::calib {

const char* to_string(Setup setup) { return setup == Setup::eye_in_hand ? "eye-in-hand" : "eye-to-hand"; }

const char* camera_parent(Setup setup) { return setup == Setup::eye_in_hand ? "gripper" : "base"; }

Setup parse_setup(const std::string& text, const std::string& source, const std::string& field) {
  if (text == "eye-in-hand") return Setup::eye_in_hand;
  if (text == "eye-to-hand") return Setup::eye_to_hand;
  throw data::input_error(source, field, "found \"" + text + "\", expected eye-in-hand or eye-to-hand");
}

}  // namespace flash::calib
