#pragma once
#include <string>

#include "data/recording/marker_tracks.h"
#include "sysid/replay/replay.h"

namespace flash::sysid {

/// The marker tracks of a recording as a simulated motion has them, at the times at which it has them, with
/// normal noise of standard deviation `noise` [m] on each coordinate. Markers on the support stay where they
/// were seen. Throws data::InputError where the recording has no tracks.
data::MarkerTracks simulated_tracks(const Replay& replay, const Motion& motion, double noise, unsigned seed);

/// Writes a recording like `like` but for its tracks, which alone it has: recording.json, tracks.csv and,
/// where `like` has them, placed.csv. The places of markers that `like` took from its first sample are kept
/// by the start of the new tracks.
void save_track_twin(const data::Recording& like, const data::MarkerTracks& tracks, const std::string& name,
                     const std::string& folder);

/// The truth behind such a recording as JSON, schema "flash-truth/1".
std::string truth_text(const ReplayCandidate& candidate, double noise, unsigned seed);

}  // namespace flash::sysid
