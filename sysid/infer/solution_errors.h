#pragma once
#include <string>
#include <vector>

#include "sysid/infer/estimate_errors.h"

namespace flash::sysid {

/// Errors of the cells of an estimate where those of a search shrink towards grasps, whose finer mesh has
/// smaller cells there alone. `here`: the estimate on the search's own mesh, one motion a recording. Empty
/// where the task has no other cells; what diverged is left out.
///
/// "half_sheet_cells": what half of the cells of the sheet change, those at the grasps apart. Motions are
/// corrected by 4/3 of that, as for an error of second order, and one standard deviation is as much.
/// "quarter_sheet_cells", where cells are coarse for the fold in which the sheet leaves the table: what
/// halving them again changes, d_2 after d_1. Motions are corrected by
///
///     d_1 + d_2 / (1 - r),    r = |d_2| / |d_1|,  at least 1/4 and at most 1/2,
///
/// r for an error of second and of first order, and one standard deviation of each is r of it.
/// "unsettled_cells": the way to the finer mesh at the grasps as a whole, where differences do not fall as
/// the extrapolation to cells of no size assumes (observed_ratio above most_ratio). "unsettled_sheet_cells":
/// the way from the halves to the quarters and beyond, likewise.
std::vector<KnownError> errors_of_cells(const Task& task, const Emulator& emulator,
                                        const std::vector<double>& values,
                                        const std::vector<ReplayResult>& here);

/// Whether the estimate has left where "half_sheet_cells" was found, by more than half of a standard
/// deviation: cells of a search answer to a change of the material otherwise than smaller ones, so that what
/// was found there is no longer what smaller cells change.
bool has_left_cells(const Posterior& posterior, const std::vector<KnownError>& errors);

/// "half_sheet_cells" of `errors` found anew, at `values`, with all that is halved twice where cells are
/// coarse there and were not before. False where a motion diverged: what there is stays then.
bool follow_with_cells(const Task& task, const std::vector<double>& values, std::vector<KnownError>& errors);

/// The error of the time step that half the step does not show: twice what a quarter of it changes then, so
/// that motions are corrected by
///
///     (x_{h/2} - x_h) + 2 (x_{h/4} - x_{h/2}),
///
/// the way to no step at all where the error is of first order from h / 2 on. `values`: the estimate. Empty
/// where a motion diverged.
std::vector<KnownError> errors_of_step(const Task& task, const std::vector<double>& values);

/// What both simulate beside the estimate itself and half the step, a recording, at most; cells as often
/// again as follow_with_cells does. Work.
inline constexpr int motions_of_solution = 7;

/// Of which replays that is.
std::vector<std::vector<Replay>> replays_of_solution(const Task& task, const std::vector<double>& values);

/// Names what cells leave open at an estimate: where the motion does not settle, where cells are coarse for
/// the fold of the sheet, and where smaller ones diverge.
void warn_of_cells(const Task& task, const std::vector<double>& values, const std::vector<KnownError>& errors,
                   std::vector<std::string>& warnings);

/// Whether an error is one of these, which are found at the first estimate and kept, or follow it.
bool is_of_solution(const KnownError& error);

/// How differences between motions fall as cells are halved, and halved again: |second| / |first|, over the
/// vertices that all meshes have, the first ones. An error of first order falls to 1/2, of second order to
/// 1/4. One motion a recording.
struct Difference {
  const std::vector<ReplayResult>&from, &to;
};
double observed_ratio(const Difference& first, const Difference& second);

/// From this ratio on the two halvings do not tell where the next ones lead; it is 1/2 at first order.
/// Chosen: half-way from first order to none; not varied.
inline constexpr double most_ratio = 0.75;

inline constexpr const char* half_sheet_cells = "half_sheet_cells";
inline constexpr const char* quarter_sheet_cells = "quarter_sheet_cells";
inline constexpr const char* unsettled_cells = "unsettled_cells";
inline constexpr const char* unsettled_sheet_cells = "unsettled_sheet_cells";
inline constexpr const char* quarter_step = "quarter_step";

}  // namespace flash::sysid
