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
  Extent extent;                    ///< of what is likely
};

/// The point of least score of each recording, of those at the values of `axes`; `of_all` where none has one.
std::vector<std::vector<double>> best_alone(const GridResults& results, const std::vector<Axis>& axes,
                                            std::size_t recordings, const std::vector<double>& of_all);

/// By which motions on the search's own mesh are corrected. `there`: the same on cells of no size.
KnownError to_no_cells(Motions own, Motions there);

/// Of each recording, by an emulator of them all on the search's own mesh, over the whole of `axes`, at whose
/// values it is exact. `at`: values of each about which its likelihood is linear first. `errors`: all that
/// are known.
std::vector<Alone> likeliest_alone(const Task& task, const Emulator& emulator, const std::vector<Axis>& axes,
                                   const std::vector<std::vector<double>>& at,
                                   const std::vector<KnownError>& errors);

/// The same from motions that are simulated anew about what was found, on the search's own mesh, of up to
/// `most` candidates a recording. A recording of which one diverges stays as it is.
void refine_alone(const Task& task, std::vector<Alone>& alone, const std::vector<KnownError>& errors,
                  std::size_t most);

/// By motions that are simulated at each recording's own values and at some values for all: the estimate, the
/// own values of each, and their mean. So no error of an emulator counts. The misfit is that which a
/// recording has at its own values, and errors of known shape are free in each recording. Were the parameters
/// the same, the excess of the best for all would be chi-square with as many degrees of freedom as there are
/// searched parameters, for each recording after the first (Wilks 1938). Own values that are not quite the
/// likeliest make it smaller.
Agreement agreement_of(const Task& task, const std::vector<Alone>& alone, const std::vector<double>& estimate,
                       const std::vector<KnownError>& errors);

/// Motions that both simulate, a recording, at most.
std::size_t most_motions_alone(std::size_t recordings, std::size_t most);

}  // namespace flash::sysid
