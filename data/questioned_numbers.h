#pragma once
#include <string>

#include "data/asset.h"

namespace flash::data {

/// One line about the numbers of an asset that sheets or solids rarely have, as units were mistaken (g/m^2
/// for kg/m^2, E t in N/m for E in Pa), with the usual ranges: from tissue to a rubber mat, from gels to
/// steel. Empty where there are none.
std::string questioned(const Asset& asset, const SheetMaterial& material);
std::string questioned(const Asset& asset, const SolidMaterial& material);

}  // namespace flash::data
