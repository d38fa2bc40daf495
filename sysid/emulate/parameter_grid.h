#pragma once
#include <optional>
#include <string>
#include <vector>

#include "sysid/emulate/parameter.h"

namespace flash::sysid {

/// One searched parameter and its values.
struct Axis {
  std::string name;            ///< short published name, see `known_parameters`
  std::vector<double> values;  ///< increasing
  bool logarithmic = false;
};

/// How the command line calls a parameter: "--start-yaw" for start_yaw.
std::string option_of(const std::string& name);

/// Throws data::InputError naming `option` and the nearest known one unless a parameter has that name.
void check_parameter(const std::string& option, const std::string& name);

/// "low:high:count:log", "low:high:count" (evenly), "a,b,c" or one value.
/// Throws data::InputError naming the option: unknown parameter (with the nearest known), malformed, out of
/// range, a value given twice.
Axis parse_axis(const std::string& name, const std::string& specification);

/// A parameter that is held at a value.
struct Hold {
  Axis axis;              ///< of one value
  bool measured = false;  ///< else it is an assumption
  std::optional<double> deviation =
      {};  ///< standard deviation; without one, what is measured counts as known
};

/// "friction=0.3", "friction=0.3:measured", or "friction=0.3+-0.02:measured" with a standard deviation.
/// Throws data::InputError naming --hold.
Hold parse_hold(const std::string& text);

/// Every combination of values, one a candidate; its index is the candidate's id, the last axis runs fastest.
std::vector<std::vector<double>> cartesian_product(const std::vector<Axis>& axes);

/// The values of one candidate, as cartesian_product lists them; `id` from 0, below count_candidates.
std::vector<double> values_of(const std::vector<Axis>& axes, int id);

/// How many cartesian_product makes.
double count_candidates(const std::vector<Axis>& axes);

/// Refuses what no experiment can answer: a parameter named twice; young and poisson searched together under
/// TRI_ARAP, whose motion depends on them through E / (1 + nu) only; bending_ratio under a bending model that
/// is not woven, young_ratio and shear_ratio under such a membrane law, yield_curvature under a bending model
/// that does not yield; what a sheet has alone of a solid, and the
/// other way round; more than a million candidates. Throws data::InputError with the reason.
void check_axes(const std::vector<Axis>& axes, const MaterialBase& base);

/// Refuses parameters of a grasp that act on none of the recordings: grasp_depth, grasp_direction and
/// grasp_pitch act on a pinch, grasp_stiffness on a clamp, grasp_size on one at a corner.
void check_grasp_axes(const std::vector<Axis>& axes, const std::vector<Replay>& replays);

/// The base with the named values in place of its own. Fixed parameters are axes of one value.
ReplayCandidate make_candidate(const MaterialBase& base, const std::vector<Axis>& axes,
                               const std::vector<double>& values);

}  // namespace flash::sysid
