#pragma once
#include "sysid/infer/discrepancy.h"
#include "sysid/observe/linear_observations.h"

namespace flash::sysid {

/// Metres of a row's error for a metre of the cloud's, one over; forces become lengths by it.
double scale_of(const LinearObservations::Row& row, const Objective& objective);

/// When, where on the sheet and of what each row is, and how much it counts: of each keyframe and term,
/// distances that are larger than its others count less.
ObservedRows observed_rows(const Replay& replay, const LinearObservations& places, const Robust& robust);

}  // namespace flash::sysid
