#pragma once
#include <string>
#include <vector>

#include "data/material.h"

namespace flash::sysid {

/// One searched parameter and its values.
struct Axis {
  std::string name;            ///< short published name, see `known_parameters`
  std::vector<double> values;  ///< increasing
  bool logarithmic = false;
};

/// A parameter that can be searched or fixed.
struct ParameterInfo {
  std::string name;
  std::string unit;
  bool material;     ///< belongs to the asset; otherwise it describes the recording (nuisance)
  double low, high;  ///< values outside are refused
  std::string meaning;
};

/// young, poisson, bending, friction, areal_density, air_drag, stiffness_damping; start_yaw, table_height,
/// grasp_depth, grasp_direction, grasp_pitch.
const std::vector<ParameterInfo>& known_parameters();

/// "low:high:count:log", "low:high:count" (linear), "a,b,c" or one value.
/// Throws data::InputError naming the flag: unknown name (with the nearest known), malformed or out of range.
Axis parse_axis(const std::string& name, const std::string& specification);

/// "friction=0.3" of `--fix`.
Axis parse_fixed(const std::string& assignment);

/// Cartesian product of the axes; the candidate's index is its id, the last axis runs fastest.
std::vector<std::vector<double>> cartesian_product(const std::vector<Axis>& axes);

/// Refuses what no experiment can answer: the same parameter twice; young and poisson together under
/// TRI_ARAP, whose motion depends on them only through E / (1 + nu). Throws data::InputError with the reason.
void check_axes(const std::vector<Axis>& axes, data::Constitutive constitutive);

}  // namespace flash::sysid
