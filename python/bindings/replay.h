#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <string>
#include <utility>
#include <vector>

#include "python/bindings/arrays.h"
#include "python/bindings/recording.h"
#include "sysid/report/asset_replay.h"

namespace flash::python {

/// A recording made ready for an asset and settings. Threads may share it.
struct PreparedReplay {
  data::Asset asset;
  sysid::AssetReplay ready;
};

/// A motion of a prepared replay as arrays: positions (T, V, 3) and forces (T - 1, 3), which may be empty.
/// Throws data::InputError where the number of vertices is another.
sysid::Motion motion_of(const PreparedReplay& prepared, const Numbers& positions, const Numbers& forces);

/// Replays, what they are apart from what was observed, and how likely they are.
void bind_replay(nanobind::module_& module);

}  // namespace flash::python
