#include "sysid/report/asset_replay.h"

#include <algorithm>

#include "data/recording/recording_digest.h"
#include "sysid/emulate/material_base.h"
#include "sysid/replay/grasp_mesh.h"
#include "sysid/report/searched_mesh.h"

namespace flash::sysid {

AssetReplay make_asset_replay(const data::Recording& recording, const data::Asset& asset,
                              ReplaySettings settings) {
  check_kind(asset, recording);
  settings.element_order = asset.element_order;
  AssetReplay ready;
  ready.identified = identified_recording(asset, data::recording_sha256(recording));
  ready.as_answered = ready.identified && settings.mesh.empty();
  if (ready.as_answered) {
    expect_as_searched(ready.identified->mesh, asset.source, "identification.recordings.mesh");
    settings.mesh = ready.identified->mesh.mesh;
    settings.cell_scale = ready.identified->mesh.cell_scale;
  }
  ready.replay = make_replay(recording, settings);
  return ready;
}

bool has_found_grasp_size(const AssetReplay& ready, const std::vector<Axis>& values) {
  return ready.identified && ready.identified->grasp_size &&
         std::none_of(values.begin(), values.end(),
                      [](const Axis& axis) { return axis.name == "grasp_size"; }) &&
         grasp_size(ready.replay.recording, ready.replay.settings);
}

ReplayCandidate candidate_of(const AssetReplay& ready, const MaterialBase& base,
                             const std::vector<Axis>& values) {
  check_axes(values, base);
  check_grasp_axes(values, {ready.replay});
  std::vector<double> numbers;
  for (const Axis& axis : values) numbers.push_back(axis.values.front());
  ReplayCandidate candidate = make_candidate(base, values, numbers);
  if (has_found_grasp_size(ready, values)) candidate.nuisance.grasp_size = ready.identified->grasp_size;
  return candidate;
}

}  // namespace flash::sysid
