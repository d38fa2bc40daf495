#include "sysid/report/parameter_label.h"

#include <algorithm>
#include <map>

namespace flash::sysid {

ParameterLabel parameter_label(const std::string& name, bool has_thickness) {
  static const std::map<std::string, ParameterLabel> labels = {
      {"poisson", {"Poisson's ratio", "ν", ""}},
      {"bending", {"bending rigidity", "D", "N m"}},
      {"friction", {"friction", "μ", ""}},
      {"areal_density", {"areal density", "ρ", "kg/m²"}},
      {"air_drag", {"air drag", "α", "1/s"}},
      {"stiffness_damping", {"stiffness damping", "β", "s"}},
      {"start_yaw", {"start yaw of the sheet", "ψ", "rad"}},
      {"table_height", {"table height", "z", "m"}},
      {"grasp_depth", {"depth of the pinch", "d", "m"}},
      {"grasp_direction", {"direction of the pinch", "φ", "rad"}},
      {"grasp_pitch", {"pitch of the grasp", "θ", "rad"}}};
  if (name == "young")
    return has_thickness ? ParameterLabel{"Young's modulus", "E", "Pa"}
                         : ParameterLabel{"membrane stiffness", "E t", "N/m"};
  const auto found = labels.find(name);
  if (found != labels.end()) return found->second;
  std::string words = name;
  std::replace(words.begin(), words.end(), '_', ' ');
  return {words, name, ""};
}

}  // namespace flash::sysid
