#pragma once
#include <optional>
#include <vector>

#include "sysid/infer/estimate_errors.h"

namespace flash::sysid {

/// Errors of the cells of an estimate where those of a search shrink towards grasps, whose finer mesh has
/// smaller cells there alone. `here`: the estimate on the search's own mesh, one motion a recording. Empty
/// where the task has no other cells; what diverged is left out.
///
/// "half_sheet_cells": by what half of the cells of the sheet moves it, those at the grasps apart, and a
/// third more, as for an error of second order; motions are corrected by that. "unsettled_cells": the way to
/// the finer mesh as a whole, where differences do not fall as the extrapolation to cells of no size assumes
/// (observed_ratio above most_ratio).
std::vector<KnownError> errors_of_cells(const Task& task, const Emulator& emulator,
                                        const std::vector<double>& values,
                                        const std::vector<ReplayResult>& here);

/// The error of the time step that half the step does not show: twice what a quarter of it changes then, so
/// that motions are corrected by
///
///     (x_{h/2} - x_h) + 2 (x_{h/4} - x_{h/2}),
///
/// the way to no step at all where the error is of first order from h / 2 on. `values`: the estimate. Empty
/// where a motion diverged.
std::vector<KnownError> errors_of_step(const Task& task, const std::vector<double>& values);

/// Whether an error is one of these, which are found at the first estimate and kept.
bool is_found_once(const KnownError& error);

/// How differences between motions fall as cells are halved, and halved again: |x_4 - x_2| / |x_2 - x_1|,
/// over the vertices that all three meshes have, the first ones. An error of first order falls to 1/2, of
/// second order to 1/4. One motion a recording.
double observed_ratio(const std::vector<ReplayResult>& cells, const std::vector<ReplayResult>& halves,
                      const std::vector<ReplayResult>& quarters);

/// From this ratio on the two halvings do not tell where the next ones lead. The extrapolation assumes 1/2,
/// and what it leaves to chance, twice its last step, allows for no more than 3/4.
inline constexpr double most_ratio = 0.75;

inline constexpr const char* half_sheet_cells = "half_sheet_cells";
inline constexpr const char* unsettled_cells = "unsettled_cells";
inline constexpr const char* quarter_step = "quarter_step";

}  // namespace flash::sysid
