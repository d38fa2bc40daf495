#pragma once
#include <string>

#include "calib/geometry/serial_chain.h"

namespace tinyxml2 {
class XMLElement;
}

namespace flash::calib {

/// The joints of a URDF from the link `base` to the link `tip`. Empty: the link without a parent, and the
/// only one without children, cameras that `export` put there left out. Continuous joints are revolute;
/// limits, masses and shapes are not read. Throws data::InputError where the file is no such XML, links are
/// missing or `tip` hangs on no chain from `base`, and where a joint is of another kind or follows another.
SerialChain load_urdf(const std::string& path, const std::string& base = "", const std::string& tip = "");

/// An element `joint` of a URDF. `path` is for messages. Throws data::InputError where it is of another kind,
/// follows another joint, or has no numbers.
Joint urdf_joint(const tinyxml2::XMLElement& element, const std::string& path);

}  // namespace flash::calib
