#pragma once
#include <string>
#include <vector>

#include "sysid/emulate/parameter_grid.h"

namespace flash::sysid {

/// Whether the recordings of a search ask for the same parameters.
struct Agreement {
  double excess = 0;  ///< of all deviances at the likeliest values for all, over those at each own values
  double chance = 1;  ///< of so large an excess, were the parameters the same in all recordings
  std::vector<std::vector<double>> alone;    ///< what each recording asks for by itself, one value an axis
  std::vector<std::vector<double>> spreads;  ///< standard deviation of its coordinate
  std::vector<double> likeliest = {};        ///< for all, of the values that were tried
  double estimate_excess = 0;                ///< of all deviances at the estimate, over those there
};

/// Chance that chi-square of so many degrees of freedom is larger than x.
double chance_beyond(double x, int freedom);

/// "the estimate is not the likeliest ...", where other values are likelier by far for recordings that do not
/// contradict each other.
std::string better_text(const Agreement& agreement, const std::vector<Axis>& axes);

/// "the recordings contradict each other: ..."; empty where chance explains the excess more than once in a
/// hundred times. `names`: of the recordings. `axes`: those of the search.
std::string contradiction_text(const Agreement& agreement, const std::vector<Axis>& axes,
                               const std::vector<std::string>& names);

}  // namespace flash::sysid
