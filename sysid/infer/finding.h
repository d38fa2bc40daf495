#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

namespace flash::sysid {

/// What the recordings say about one parameter.
enum class Identifiable { yes, no, lower_bound, upper_bound };

/// Whether the estimate sits on a border of the searched range.
enum class RangeEdge { none, low, high };

/// One searched parameter: the estimate, how sure it is, and the profile both were read from.
struct ParameterFinding {
  std::string name;                ///< published short name: young, poisson, bending, friction, ...
  std::optional<double> estimate;  ///< in the unit of the asset field
  std::optional<std::array<double, 2>> interval95;  ///< 95 % confidence
  Identifiable identifiable = Identifiable::no;
  std::optional<double> bits;  ///< information gained over what is usual; none without an interval
  RangeEdge edge = RangeEdge::none;
  std::string note;            ///< why, one line
  bool logarithmic = false;    ///< searched on a logarithmic axis
  std::vector<double> values;  ///< profile: values of this parameter that were simulated, increasing
  std::vector<double> scores;  ///< profile: best score of a candidate with each value [m]
};

std::string to_string(Identifiable identifiable);
std::string to_string(RangeEdge edge);  ///< "low", "high", or "" for none
std::string edge_text(
    RangeEdge edge);  ///< "the best value is the lowest searched: search lower"; "" for none

}  // namespace flash::sysid
