#pragma once
#include <string>

#include "data/recording/recording.h"

namespace flash::data {

class JsonObject;

/// Reads `markers` of recording.json: tracks, and where the markers are on the object. Throws InputError
/// where a marker of `on_support` moves by more than 5 mm; from 1 mm on it is one of the recording's doubts.
/// Both grow by what its scatter explains.
void read_markers(const JsonObject& file, Recording& recording);

/// A keyframe for each time of the tracks, among those that there are.
void add_tracked_keyframes(Recording& recording);

/// The pose that takes markers from where `placed` has them to where they were seen first, in the least
/// squares (Umeyama 1991). Those that are on the object count where they were seen at the recording's start.
/// Throws InputError where fewer than three are left, or all are on a line.
void place_object_by_markers(Recording& recording);

/// Where on the object each marker is: where it was at the recording's start, or else where `placed` has it.
void place_markers(Recording& recording);

}  // namespace flash::data
