#pragma once
#include <string>
#include <vector>

#include "data/asset/asset.h"
#include "data/recording/recording.h"
#include "sysid/emulate/parameter_grid.h"

namespace flash::sysid {

/// Throws data::InputError where the recording is of a sheet and the asset of a solid, or the other way
/// round.
void check_kind(const data::Asset& asset, const data::Recording& recording);

/// The asset's material; what was understood, with `fixed` in place of the asset's values, is appended to
/// `notices`.
MaterialBase material_base(const data::Asset& asset, const sim::Sheet& sheet,
                           std::vector<std::string>& notices, const std::vector<Axis>& fixed = {});

}  // namespace flash::sysid
