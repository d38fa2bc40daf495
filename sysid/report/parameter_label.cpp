#include "sysid/report/parameter_label.h"

#include <algorithm>
#include <map>

namespace flash::sysid {

ParameterLabel parameter_label(const std::string& name, bool has_thickness) {
  static const std::map<std::string, ParameterLabel> labels = {
      {"poisson", {"Poisson's ratio", "ν", ""}},
      {"bending", {"bending rigidity", "D", "N m"}},
      {"bending_ratio", {"bending, weft over warp", "D₂/D₁", ""}},
      {"young_ratio", {"stiffness, weft over warp", "E₂/E₁", ""}},
      {"shear_ratio", {"shear modulus over that of an isotropic sheet", "G/G₀", ""}},
      {"yield_curvature", {"curvature at which it yields", "κ", "1/m"}},
      {"friction", {"friction", "μ", ""}},
      {"areal_density", {"areal density", "ρ", "kg/m²"}},
      {"density", {"density", "ρ", "kg/m³"}},
      {"air_drag", {"air drag", "α", "1/s"}},
      {"stiffness_damping", {"stiffness damping", "β", "s"}},
      {"start_yaw", {"start yaw of the sheet", "ψ", "rad"}},
      {"table_height", {"table height", "z", "m"}},
      {"grasp_size", {"size of the grasp", "s", "m"}},
      {"grasp_stiffness", {"stiffness of the pads", "k", "N/m³"}},
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

std::string solver_check_label(const std::string& what) {
  static const std::map<std::string, std::string> labels = {
      {"estimate_itself", "simulated, not interpolated"},
      {"double_mesh", "cells of no size"},
      {"half_sheet_cells", "cells of the sheet halved"},
      {"quarter_sheet_cells", "cells of the sheet halved again"},
      {"half_step", "half the time step"},
      {"quarter_step", "a quarter of the time step"},
      {"four_times_iterations", "four times the iterations"}};
  const auto found = labels.find(what);
  return found == labels.end() ? what : found->second;
}

}  // namespace flash::sysid
