#pragma once
#include <string>
#include <vector>

#include "sysid/infer/adaptive_design.h"

namespace flash::sysid {

/// What each recording asks for by itself, against what all ask for together.
struct Agreement {
  double excess = 0;  ///< of the deviance where all together are likeliest, over the least of each by itself
  double chance = 1;  ///< of so large an excess, were the parameters the same in all recordings
  std::vector<std::vector<double>> alone;  ///< values at which each recording by itself is likeliest
};

/// -2 log likelihood of each recording at the points of a grid, a column a recording. Where the recordings
/// have the same parameters, the excess is chi-square with as many degrees of freedom as parameters, for each
/// recording after the first (Wilks 1938). `axes`: of the points, the last axis fastest.
Agreement agreement_of(const std::vector<Axis>& axes, const Eigen::MatrixXd& deviances);

/// At the points of `axes`, where the emulator is exact. `likelihood`: of all recordings.
Agreement agreement_of(const Emulator& emulator, const std::vector<Axis>& axes,
                       const MotionLikelihood& likelihood, const GridSettings& grid);

/// "the recordings contradict each other: ..."; empty where chance explains the excess more than once in a
/// hundred times. `names`: of the recordings.
std::string contradiction_text(const Agreement& agreement, const std::vector<Axis>& axes,
                               const std::vector<std::string>& names);

}  // namespace flash::sysid
