#pragma once
#include <vector>

#include "sysid/infer/agreement.h"
#include "sysid/infer/estimate_errors.h"

namespace flash::sysid {

/// What one recording of a search makes likeliest by itself.
struct Alone {
  std::vector<double> values;
  std::vector<double> spreads;      ///< standard deviation of the coordinate of each
  std::vector<MotionChange> rates;  ///< of its motion there, with each searched parameter
};

/// Of each recording, by an emulator of them all. `axes`: at whose values it is exact. `at`: of each
/// recording, the point of `axes` with the least score, about which it is sought. `errors`: all that are
/// known.
std::vector<Alone> likeliest_alone(const Task& task, const Emulator& emulator, const std::vector<Axis>& axes,
                                   const std::vector<std::vector<double>>& at,
                                   const std::vector<KnownError>& errors);

/// By motions that are simulated at both, so that no error of an emulator counts. The misfit is that which a
/// recording has at its own values, and errors of known shape are free in each recording. Were the parameters
/// the same, the excess would be chi-square with as many degrees of freedom as there are searched parameters,
/// for each recording after the first (Wilks 1938). Own values that are not quite the likeliest make it
/// smaller. `together`: the motion of the estimate, one a recording, on the search's own mesh.
Agreement agreement_of(const Task& task, const std::vector<Alone>& alone,
                       const std::vector<ReplayResult>& together, const std::vector<KnownError>& errors);

}  // namespace flash::sysid
