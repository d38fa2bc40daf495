#pragma once
#include <string>

namespace flash::sysid {

/// How a person reads a parameter.
struct ParameterLabel {
  std::string label;   ///< "bending rigidity"
  std::string symbol;  ///< "D"
  std::string unit;    ///< "N m"; empty where there is none
};

/// Label of a parameter by its short name; an unknown one is its own label. `has_thickness`: young is E [Pa]
/// beside a thickness, and E t [N/m] without.
ParameterLabel parameter_label(const std::string& name, bool has_thickness);

/// What a SolverCheck compares: "half the time step" for half_step.
std::string solver_check_label(const std::string& what);

}  // namespace flash::sysid
