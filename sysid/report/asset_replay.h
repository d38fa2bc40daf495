#pragma once
#include <optional>
#include <string>
#include <vector>

#include "data/asset/asset.h"
#include "data/recording/recording.h"
#include "sysid/emulate/parameter_grid.h"
#include "sysid/replay/replay.h"
#include "sysid/report/identified_recording.h"

namespace flash::sysid {

/// A recording made ready to be replayed with an asset, as `flash-sysid replay` does.
struct AssetReplay {
  Replay replay;
  std::optional<IdentifiedRecording> identified;  ///< of an asset that was identified from this recording
  bool as_answered = false;                       ///< on the mesh of the answer behind the asset
};

/// On the mesh that `settings` name, or that of the answer behind the asset, or the recording's own. Throws
/// data::InputError where asset and recording are of different kinds, and as make_replay does.
AssetReplay make_asset_replay(const data::Recording& recording, const data::Asset& asset,
                              ReplaySettings settings);

/// Axes of one value each as a candidate on `base`. A grasp has the size that the search behind the asset
/// found, unless an axis has another. Throws data::InputError for values that the object or its grasps do not
/// have.
ReplayCandidate candidate_of(const AssetReplay& ready, const MaterialBase& base,
                             const std::vector<Axis>& values);

/// Whether the patch of such a candidate has the size that the search behind the asset found.
bool has_found_grasp_size(const AssetReplay& ready, const std::vector<Axis>& values);

}  // namespace flash::sysid
