#pragma once
#include <map>
#include <string>
#include <vector>

#include "data/asset/asset.h"
#include "sysid/emulate/grid_search.h"
#include "sysid/replay/replay.h"

namespace flash::sysid {

/// How motions are simulated and scored, in words by name: mesh, grasp_shape, time_step_s, ... What a summary
/// has as `settings` and a tuned asset as `identification.solver`.
std::map<std::string, std::string> settings_texts(const std::vector<Replay>& replays,
                                                  const GridSettings& settings);

/// What differs from the search that a tuned asset comes from, a line each: "--grasp-shape: found clamp, the
/// search behind the asset had point". `held`: axes of one value. The mesh is compared where the object is
/// the same. Of what describes the recording, as its start yaw, values that the search told or held count.
/// Empty of other assets.
std::vector<std::string> unlike_the_search(const data::Asset& asset,
                                           const std::map<std::string, std::string>& settings,
                                           const std::vector<Axis>& held);

}  // namespace flash::sysid
